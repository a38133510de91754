// Over MPI, each process hosting one rank or several. No other header but mpi_node.hpp includes mpi.h, and none
// includes this one.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nscdd/comm/mpi_node.hpp"
#include "nscdd/comm/reduction_rounds.hpp"

namespace nscdd::inline NSCDD_ABI {

// Meanings and shapes of the calls: communicator.hpp. All are collective.
//
// Throws std::runtime_error when MPI fails (a message longer than expected is such a failure) and std::logic_error
// when a shape is wrong or a message shorter than expected. The other processes may then wait for this one, so
// that the caller can only abort. Channels must be gone before their communicator.
//
// Wait and transfer are told apart as in late-sender analysis (Scalasca): every message carries the time at which
// its sender entered the call; what lies between our entry and that of the latest partner is wait, the rest is
// transfer.
//
// Ranks are dealt to processes in contiguous ranges. What the ranks of one process send to those of another is one
// message.
class Mpi final : public Communicator {
  public:
    // Works on a duplicate of `comm`. The caller initialises MPI before and finalises it after. Collective. `charged`,
    // if given, is called at every charge(), and for the messages of channels and reductions. `size`: ranks in all, the
    // same on every process; 0: one a process. `within`: how messages go between processes of a node. Throws
    // std::invalid_argument for fewer ranks than processes.
    explicit Mpi(MPI_Comm comm = MPI_COMM_WORLD, Charged charged = {}, int size = 0,
                 WithinNode within = WithinNode::memory)
        : comm_(comm),
          hosted_(comm_.place(&MPI_Comm_rank), comm_.place(&MPI_Comm_size), size),
          node_(comm_.handle, within),
          charged_(std::move(charged)) {
        synchronise_clock();
    }

    int size() const override { return hosted_.size(); }
    std::span<const int> ranks() const override { return hosted_.ranks(); }

    // Throws std::logic_error for a peer that is no rank, and for a message through memory of another length than
    // expected. Of other messages finish() throws std::logic_error when one is shorter, std::runtime_error when longer.
    std::unique_ptr<Channel> open(const std::vector<Links>& links) override {
        check_count(links.size(), "open");
        for (std::size_t k = 0; k < links.size(); ++k)
            for (const Link& link : links[k]) check_peer("open", k, link.peer);
        return std::make_unique<Messages>(*this, links);
    }

    // Each message goes alone to its target, which learns of it by probing and answers with an empty one. A rank that
    // has all its answers enters a barrier; when the barrier is over, no message is under way (as NBX, Hoefler,
    // Siebert, Lumsdaine, PPoPP 2010, does by synchronous sends). The barrier is a reduction of nothing: SimGrid 3.32
    // lets ranks through MPI_Ibarrier when rank 0 has come to it, whoever else has not.
    std::vector<Buffer> route(const std::vector<Outbox>& out) override {
        const double entry = now();
        check_count(out.size(), "route");
        std::map<int, Buffer> staged, arrived;  // by process: target, source, length, message, of each; then a stamp
        for (std::size_t k = 0; k < out.size(); ++k)
            for (const auto& [target, message] : out[k]) {
                check_peer("route", k, target);
                if (message.empty()) continue;
                Buffer& to = (hosted_.hosts(target) ? arrived : staged)[hosted_.process_of(target)];
                to.insert(to.end(), {double(target), double(hosted_.ranks()[k]), double(message.size())});
                to.insert(to.end(), message.begin(), message.end());
                if (target != hosted_.ranks()[k]) count(message.size());
            }
        requests_.clear();
        routes_ = 1 - routes_;  // messages of the next route do not meet this one's
        const auto send = [&](int process, const Buffer& message) {
            check(MPI_Isend(message.data(), narrow(message.size()), MPI_DOUBLE, process, route_tag + routes_,
                            comm_.handle, &requests_.emplace_back()),
                  "route");
        };
        for (auto& [process, message] : staged) {
            message.push_back(entry);
            send(process, message);
        }
        const Buffer answer;
        double latest = entry;
        std::size_t unanswered = staged.size();
        for (bool inside = false, over = false; !over;) {
            if (unanswered == 0 && !inside) {
                inside = true;
                barrier_.start(std::vector<Buffer>(hosted_.count()), 0, entry);
            }
            int there = 0, n = 0;
            MPI_Status status;
            check(MPI_Iprobe(MPI_ANY_SOURCE, route_tag + routes_, comm_.handle, &there, &status), "route");
            if (!there) {
                if (!inside) continue;
                barrier_.go_on(false);
                over = !barrier_.under_way();
                continue;
            }
            check(MPI_Get_count(&status, MPI_DOUBLE, &n), "route");
            Buffer message(static_cast<std::size_t>(n));
            check(MPI_Recv(message.data(), n, MPI_DOUBLE, status.MPI_SOURCE, route_tag + routes_, comm_.handle,
                           MPI_STATUS_IGNORE),
                  "route");
            if (message.empty()) {
                --unanswered;
                continue;
            }
            latest = std::max(latest, message.back());
            message.pop_back();
            arrived[status.MPI_SOURCE] = std::move(message);
            send(status.MPI_SOURCE, answer);
        }
        check(MPI_Waitall(narrow(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE), "route");
        std::vector<Buffer> in(hosted_.count());
        for (const auto& [process, messages] : arrived)
            for (auto at = messages.begin(); at != messages.end();) {
                Buffer& to = in[hosted_.index(static_cast<int>(at[0]))];
                const auto begin = at + 3, end = begin + static_cast<std::ptrdiff_t>(at[2]);
                to.insert(to.end(), begin, end);
                at = end;
            }
        spent(entry, latest);
        return in;
    }

    // Every process sends as many doubles, also one with fewer ranks than others.
    std::span<const double> all_gather(const std::vector<Buffer>& mine) override {
        const double entry = now();
        check_count(mine.size(), "all_gather");
        const std::size_t n = mine[0].size(), most = hosted_.most() * n + 1,
                          size = static_cast<std::size_t>(hosted_.size());
        send_.assign(most, entry);  // the last is the stamp
        recv_.resize(static_cast<std::size_t>(hosted_.processes()) * most);
        for (std::size_t k = 0; k < mine.size(); ++k) std::ranges::copy(mine[k], send_.data() + k * n);
        check(
            MPI_Allgather(send_.data(), narrow(most), MPI_DOUBLE, recv_.data(), narrow(most), MPI_DOUBLE, comm_.handle),
            "all_gather");
        double latest = entry;
        gathered_.clear();
        for (int p = 0; p < hosted_.processes(); ++p) {
            const double* const from = recv_.data() + static_cast<std::size_t>(p) * most;
            const auto rows = static_cast<std::size_t>(hosted_.first(p + 1) - hosted_.first(p));
            gathered_.insert(gathered_.end(), from, from + rows * n);
            latest = std::max(latest, from[most - 1]);
        }
        for (const int rank : hosted_.ranks())
            if (rank != 0)
                count(n);  // up to rank 0; MPI may do otherwise, the count is that of the contract
            else
                for (std::size_t r = 1; r < size; ++r) count(size * n);  // and down again
        spent(entry, latest);
        return gathered_;
    }

    // MPI_Allreduce may add in any order, so the kernel sends messages of its own.
    void start_reduce(const std::vector<Buffer>& mine, std::size_t added) override {
        const double entry = now();
        check_count(mine.size(), "reduce");
        reduction_.start(mine, added, entry);
        spent(entry, entry);
    }
    std::span<const double> finish_reduce() override {
        const double entry = now();
        reduction_.go_on(true);
        spent(entry, reduction_.rows().stamp());
        return reduction_.rows().row(0);
    }
    // Looking into a mailbox takes less time than looking at the clock, and is not counted.
    void advance() override {
        if (!reduction_.awaits_mpi()) return reduction_.go_on(false);
        const double entry = now();
        reduction_.go_on(false);
        spent(entry, entry);
    }

    // The clock of rank 0 [s], as well as this process knows it.
    double now() const override { return MPI_Wtime() + offset_; }
    // Throws std::out_of_range for a rank that is not hosted.
    void charge(int rank, Work kind, double count, double bytes) override {
        work_.at(static_cast<std::size_t>(rank)) += contacts_swept(kind, count);
        if (charged_) charged_(kind, count, bytes);
    }
    std::span<const double> work() const override { return work_; }
    Traffic traffic() const override { return traffic_; }
    CommSeconds seconds() const override { return seconds_; }

  private:
    static constexpr int tag = 0, route_tag = 1, reduce_tag = 3, barrier_tag = 4, first_channel_tag = 5;
    // One message to each process that this one sends to, and one from each that it receives from. Every message ends
    // with a stamp, the time at which its sender called start(). Requests are not persistent: with Open MPI 4.1.4 calls
    // for a message of up to 256 bytes then take half the time, for others the same (reports/findings/two-cores.md).
    class Messages final : public Channel {
      public:
        Messages(Mpi& comm, const std::vector<Links>& links)
            : comm_(comm), layout_(comm.hosted_, links, send_, recv_), tag_(comm.next_channel_tag()) {
            for (std::size_t k = 0; k < links.size(); ++k)
                for (const Link& link : links[k])
                    if (link.peer != comm.hosted_.ranks()[k]) messages_ += 1, doubles_ += link.send;
            mailboxes_ = comm.node_.open(sizes(layout_.outgoing), sizes(layout_.incoming));
            requests_.assign(layout_.incoming.size() + layout_.outgoing.size(), MPI_REQUEST_NULL);
            statuses_.resize(requests_.size());
        }

        void start() override {
            const double entry = comm_.now();
            charge_calls(layout_.outgoing, mailboxes_.outgoing_shared);
            MPI_Request* request = requests_.data();
            for (std::size_t m = 0; m < layout_.incoming.size(); ++m, ++request) {
                if (mailboxes_.incoming[m]) continue;
                const auto& [process, message] = layout_.incoming[m];
                check(MPI_Irecv(message.data(), narrow(message.size()), MPI_DOUBLE, process, tag_, comm_.comm_.handle,
                                request),
                      "start");
            }
            for (std::size_t m = 0; m < layout_.outgoing.size(); ++m, ++request) {
                const auto& [process, message] = layout_.outgoing[m];
                message.back() = entry;
                if (Mailbox& mailbox = mailboxes_.outgoing[m])
                    mailbox.put(message);
                else
                    check(MPI_Isend(message.data(), narrow(message.size()), MPI_DOUBLE, process, tag_,
                                    comm_.comm_.handle, request),
                          "start");
            }
            comm_.traffic_.messages += messages_;
            comm_.traffic_.bytes += static_cast<double>(doubles_ * sizeof(double));
            comm_.spent(entry, entry);
        }
        // Messages of MPI first, since they go on while something of MPI waits.
        void finish() override {
            const double entry = comm_.now();
            // Waits for all requests even after an error: those under way still use our memory.
            int code = MPI_SUCCESS;
            for (std::size_t k = 0; k < requests_.size(); ++k) {
                if (requests_[k] == MPI_REQUEST_NULL) continue;
                const int failed = MPI_Wait(&requests_[k], &statuses_[k]);
                if (code == MPI_SUCCESS) code = failed;
            }
            check(code, "finish");
            double latest = entry;
            for (std::size_t m = 0; m < layout_.incoming.size(); ++m) {
                const auto& [process, message] = layout_.incoming[m];
                if (Mailbox& mailbox = mailboxes_.incoming[m])
                    mailbox.take(message);
                else
                    check_length(statuses_[m], process, message.size());
                latest = std::max(latest, message.back());
            }
            charge_calls(layout_.incoming, mailboxes_.incoming_shared);
            comm_.spent(entry, latest);
        }

      private:
        static std::vector<detail::NodeMemory::Message> sizes(
            const std::vector<detail::MessageLayout::Message>& messages) {
            std::vector<detail::NodeMemory::Message> sizes;
            for (const auto& [process, message] : messages) sizes.push_back({process, message.size()});
            return sizes;
        }
        void charge_calls(const std::vector<detail::MessageLayout::Message>& messages,
                          const std::vector<char>& shared) const {
            for (std::size_t m = 0; m < messages.size(); ++m) comm_.charge_call(messages[m].doubles.size(), shared[m]);
        }
        void check_length(const MPI_Status& status, int process, std::size_t expected) const {
            int n = 0;
            check(MPI_Get_count(&status, MPI_DOUBLE, &n), "finish");
            if (n != narrow(expected))
                throw std::logic_error("finish: the message of process " + std::to_string(process) + " to process " +
                                       std::to_string(comm_.hosted_.process()) + " is shorter than expected");
        }

        Mpi& comm_;
        detail::MessageLayout layout_;
        detail::NodeMemory::Mailboxes mailboxes_;
        int tag_;
        std::vector<MPI_Request>
            requests_;  // of incoming messages, then of outgoing ones; null for those with a mailbox
        std::vector<MPI_Status> statuses_;
        double messages_ = 0;
        std::size_t doubles_ = 0;
    };

    // The same on every rank, for channels are opened by all together. MPI guarantees 32767 tags: 30,000 channels
    // opened one after the other may not be in use at once.
    int next_channel_tag() { return first_channel_tag + channels_++ % 30'000; }

    // A reduction in rounds of messages (ReductionRounds). In the iteration: traffic() counts its messages, and they go
    // through memory where they can.
    class Reduction {
      public:
        Reduction(Mpi& comm, int own_tag, bool in_iteration)
            : comm_(comm), rows_(comm.hosted_), own_tag_(own_tag), in_iteration_(in_iteration) {
            for (int step = 1; in_iteration && rows_.rounds().has(step); step *= ReductionRounds::group) {
                std::vector<detail::NodeMemory::Message> outgoing, incoming;
                rows_.visit_partners(
                    step,
                    [&incoming](int process, std::size_t rows) {
                        incoming.push_back({process, rows * longest});
                    },
                    [&outgoing](int process, std::size_t rows) {
                        outgoing.push_back({process, rows * longest});
                    });
                mailboxes_.push_back(comm.node_.open(outgoing, incoming));
            }
        }

        bool under_way() const { return rows_.under_way(); }
        bool awaits_mpi() const { return received_ < awaited_.size() && !awaited_[received_].mailbox; }
        const ReducedRows& rows() const { return rows_; }

        void start(const std::vector<Buffer>& mine, std::size_t added, double stamp) {
            rows_.start(mine, added, stamp);
            round_ = 0;
            start_round();
        }
        // Continues the reduction: to its end if `wait`, else as far as possible without waiting. One message is asked
        // for at a time, so that a call costs little: the first one that is not there ends it.
        void go_on(bool wait) {
            for (; under_way(); finish_round())
                for (; received_ < awaited_.size(); ++received_)
                    if (!receive(awaited_[received_], wait)) return;
        }

      private:
        static constexpr std::size_t longest = 64;  // doubles of a row that goes through memory

        struct Awaited {
            MPI_Request request = MPI_REQUEST_NULL;
            Mailbox* mailbox = nullptr;
            Buffer* rows = nullptr;
        };

        // False if the message is not there and must not be waited for.
        static bool receive(Awaited& awaited, bool wait) {
            if (awaited.mailbox) {
                if (!wait && !awaited.mailbox->there()) return false;
                awaited.mailbox->take(*awaited.rows);
                return true;
            }
            int there = 1;
            check(wait ? MPI_Wait(&awaited.request, MPI_STATUS_IGNORE)
                       : MPI_Test(&awaited.request, &there, MPI_STATUS_IGNORE),
                  "reduce");
            return there != 0;
        }

        void start_round() {
            awaited_.clear();
            sending_.clear();
            received_ = 0;
            if (!under_way()) return;
            std::size_t from = 0, to = 0;  // in the mailboxes of the round
            rows_.trade(
                [&](int process, Buffer& rows) {
                    Awaited& awaited = awaited_.emplace_back();
                    awaited.rows = &rows;
                    if (in_iteration_) awaited.mailbox = mailbox(mailboxes_[round_].incoming, from++, rows);
                    if (!awaited.mailbox)
                        check(MPI_Irecv(rows.data(), narrow(rows.size()), MPI_DOUBLE, process, own_tag_,
                                        comm_.comm_.handle, &awaited.request),
                              "reduce");
                },
                [&](int process, Buffer& rows) {
                    if (in_iteration_) comm_.charge_call(rows.size(), shared(mailboxes_[round_].outgoing_shared, to));
                    if (Mailbox* const way = in_iteration_ ? mailbox(mailboxes_[round_].outgoing, to++, rows) : nullptr)
                        way->put(rows);
                    else
                        check(MPI_Isend(rows.data(), narrow(rows.size()), MPI_DOUBLE, process, own_tag_,
                                        comm_.comm_.handle, &sending_.emplace_back()),
                              "reduce");
                },
                [this](std::span<const double> row) {
                    if (in_iteration_) comm_.count(row.size());
                });
        }
        // Rows are short, so that MPI sends them at once: nobody waits here for a receiver that computes.
        void finish_round() {
            check(MPI_Waitall(narrow(sending_.size()), sending_.data(), MPI_STATUSES_IGNORE), "reduce");
            for (std::size_t m = 0; in_iteration_ && m < awaited_.size(); ++m)
                comm_.charge_call(awaited_[m].rows->size(), shared(mailboxes_[round_].incoming_shared, m));
            rows_.finish_round();
            ++round_;
            start_round();
        }

        // The m-th mailbox if it is one and these rows fit, else null.
        static Mailbox* mailbox(std::vector<Mailbox>& mailboxes, std::size_t m, const Buffer& rows) {
            return mailboxes[m] && rows.size() <= mailboxes[m].doubles() ? &mailboxes[m] : nullptr;
        }
        // Whether the m-th message goes through memory, or is to be charged as if it did.
        bool shared(const std::vector<char>& shared, std::size_t m) const {
            return shared[m] && rows_.row(0).size() < longest;
        }

        Mpi& comm_;
        ReducedRows rows_;
        std::vector<detail::NodeMemory::Mailboxes> mailboxes_;  // by round
        std::vector<Awaited> awaited_;                          // of the round under way
        std::vector<MPI_Request> sending_;
        std::size_t received_ = 0, round_ = 0;
        int own_tag_;
        bool in_iteration_;
    };

    // A duplicate of the caller's communicator, so that our messages never meet the caller's.
    struct Duplicate {
        MPI_Comm handle = MPI_COMM_NULL;

        explicit Duplicate(MPI_Comm comm) {
            int initialised = 0;
            MPI_Initialized(&initialised);
            if (!initialised) throw std::logic_error("Mpi: MPI is not initialised");
            check(MPI_Comm_dup(comm, &handle), "MPI_Comm_dup");
            check(MPI_Comm_set_errhandler(handle, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
        }
        // The number that MPI_Comm_rank or MPI_Comm_size gives.
        int place(int (*ask)(MPI_Comm, int*)) const {
            int number = 0;
            check(ask(handle, &number), "MPI_Comm_rank or MPI_Comm_size");
            return number;
        }
        Duplicate(const Duplicate&) = delete;
        Duplicate& operator=(const Duplicate&) = delete;
        ~Duplicate() {
            int finalised = 0;
            MPI_Finalized(&finalised);
            if (!finalised) MPI_Comm_free(&handle);
        }
    };

    static void check(int code, const char* call) { detail::check_mpi(code, call); }

    void check_count(std::size_t buffers, const char* call) const {
        if (buffers != hosted_.count())
            throw std::logic_error(std::string(call) + ": " + std::to_string(buffers) + " buffers for " +
                                   std::to_string(hosted_.count()) + " ranks");
    }

    void check_peer(const char* call, std::size_t k, int peer) const {
        if (peer < 0 || peer >= size())
            throw std::logic_error(std::string(call) + ": rank " + std::to_string(hosted_.ranks()[k]) +
                                   " has a message for rank " + std::to_string(peer) + " of " + std::to_string(size()));
    }

    // MPI counts in int.
    static int narrow(std::size_t n) {
        if (!std::in_range<int>(n)) throw std::length_error("Mpi: " + std::to_string(n) + " doubles in one message");
        return static_cast<int>(n);
    }

    void count(std::size_t doubles) {
        traffic_.messages += 1;
        traffic_.bytes += static_cast<double>(doubles * sizeof(double));
    }

    // What sending or receiving takes for a message, on a simulated machine, which lets messages pass without it.
    void charge_call(std::size_t doubles, bool shared) const {
        if (charged_) charged_(shared ? Work::shared_message : Work::message, 1, double(doubles * sizeof(double)));
    }

    void spent(double entry, double latest) {
        const double elapsed = std::max(now() - entry, 0.0);
        const double wait = std::clamp(latest - entry, 0.0, elapsed);
        seconds_.wait += wait;
        seconds_.transfer += elapsed - wait;
    }

    // Clocks of different processes may differ by anything: each process asks the first one for the time several times,
    // and takes the answer that came back soonest. Good to half a round trip; later drift is not followed.
    void synchronise_clock() {
        int *global = nullptr, found = 0;
        check(MPI_Comm_get_attr(MPI_COMM_WORLD, MPI_WTIME_IS_GLOBAL, static_cast<void*>(&global), &found), "clock");
        if (found && *global) return;
        constexpr int rounds = 20;
        for (int r = 1; hosted_.process() == 0 && r < hosted_.processes(); ++r)
            for (int round = 0; round < rounds; ++round) {
                check(MPI_Recv(nullptr, 0, MPI_DOUBLE, r, tag, comm_.handle, MPI_STATUS_IGNORE), "clock");
                const double time = MPI_Wtime();
                check(MPI_Send(&time, 1, MPI_DOUBLE, r, tag, comm_.handle), "clock");
            }
        double shortest = std::numeric_limits<double>::infinity();
        for (int round = 0; hosted_.process() != 0 && round < rounds; ++round) {
            double time = 0;
            const double asked = MPI_Wtime();
            check(MPI_Send(nullptr, 0, MPI_DOUBLE, 0, tag, comm_.handle), "clock");
            check(MPI_Recv(&time, 1, MPI_DOUBLE, 0, tag, comm_.handle, MPI_STATUS_IGNORE), "clock");
            const double answered = MPI_Wtime();
            if (answered - asked >= shortest) continue;
            shortest = answered - asked;
            offset_ = time - (asked + answered) / 2;
        }
    }

    Duplicate comm_;
    HostedRanks hosted_;
    detail::NodeMemory node_;
    double offset_ = 0;  // to the clock of rank 0 [s]

    // Staging, which only grows.
    Buffer send_, recv_, gathered_;
    Reduction reduction_{*this, reduce_tag, true}, barrier_{*this, barrier_tag, false};
    std::vector<MPI_Request> requests_;
    int routes_ = 0, channels_ = 0;

    std::vector<double> work_ = std::vector<double>(hosted_.count());
    Charged charged_;
    Traffic traffic_;
    CommSeconds seconds_;
};

}  // namespace nscdd
