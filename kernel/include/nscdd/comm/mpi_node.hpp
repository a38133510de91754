// Memory that the processes of a node share, and the mailboxes in it (mailbox.hpp). Includes mpi.h, as mpi.hpp does.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <exception>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nscdd/comm/mailbox.hpp"

namespace nscdd::inline NSCDD_ABI {

// How messages of the iteration go from process to process within a node.
enum class WithinNode {
    memory,    // through memory that the processes share, where MPI gives it and they fit; other messages as below
    messages,  // as messages of MPI
    modelled   // as messages of MPI that are charged as if they went through memory: for simulated machines
};

namespace detail {

// Throws std::runtime_error with the text of MPI unless the call went well.
inline void check_mpi(int code, const char* call) {
    if (code == MPI_SUCCESS) return;
    char text[MPI_MAX_ERROR_STRING];
    int length = 0;
    MPI_Error_string(code, text, &length);
    throw std::runtime_error(std::string(call) + ": " + std::string(text, static_cast<std::size_t>(length)));
}

// Each process of a node has a segment of shared memory, in which the messages lie that it sends.
class NodeMemory {
  public:
    // A message between this process and another one of the communicator.
    struct Message {
        int process;
        std::size_t doubles;  // at most
    };

    // Mailboxes for messages to and from processes; must not outlive the memory.
    class Mailboxes {
      public:
        // By place in the list that open() was given. An empty one: the message has to go as one of MPI.
        std::vector<Mailbox> outgoing, incoming;
        // By place in the lists: whether the message goes through memory, or is to be charged as if it did.
        std::vector<char> outgoing_shared, incoming_shared;

        Mailboxes() = default;
        Mailboxes(NodeMemory& memory, std::size_t begin) : memory_(&memory), begin_(begin) {}
        Mailboxes(Mailboxes&& other) noexcept { *this = std::move(other); }
        Mailboxes& operator=(Mailboxes&& other) noexcept {
            std::swap(outgoing, other.outgoing);
            std::swap(incoming, other.incoming);
            std::swap(outgoing_shared, other.outgoing_shared);
            std::swap(incoming_shared, other.incoming_shared);
            std::swap(memory_, other.memory_);
            std::swap(begin_, other.begin_);
            return *this;
        }
        ~Mailboxes() {
            if (memory_) memory_->taken_.erase(begin_);
        }

      private:
        NodeMemory* memory_ = nullptr;
        std::size_t begin_ = 0;
    };

    // For the processes of `comm` that share memory with this one, each with a segment of so many bytes. Collective.
    NodeMemory(MPI_Comm comm, WithinNode how, std::size_t bytes = std::size_t{1} << 20)
        : words_(how == WithinNode::messages ? 0 : bytes / sizeof(Mailbox::Word)),
          exceptions_(std::uncaught_exceptions()) {
        if (how == WithinNode::messages) return;
        int process = 0, processes = 0, members = 0;
        check_mpi(MPI_Comm_rank(comm, &process), "MPI_Comm_rank");
        check_mpi(MPI_Comm_size(comm, &processes), "MPI_Comm_size");
        check_mpi(MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, process, MPI_INFO_NULL, &node_),
                  "MPI_Comm_split_type");
        check_mpi(MPI_Comm_set_errhandler(node_, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
        check_mpi(MPI_Comm_size(node_, &members), "MPI_Comm_size");
        std::vector<int> processes_here(static_cast<std::size_t>(members));
        check_mpi(MPI_Allgather(&process, 1, MPI_INT, processes_here.data(), 1, MPI_INT, node_), "MPI_Allgather");
        for (int m = 0; m < members; ++m) members_[processes_here[static_cast<std::size_t>(m)]] = m;
        segments_.assign(members_.size(), nullptr);
        announced_.resize(members_.size());
        known_.resize(members_.size());
        if (how == WithinNode::memory && members > 1) allocate();
    }
    NodeMemory(const NodeMemory&) = delete;
    NodeMemory& operator=(const NodeMemory&) = delete;
    // Freeing is collective: a process that leaves by an exception leaves the memory to the end of the program.
    ~NodeMemory() {
        int finalised = 0;
        MPI_Finalized(&finalised);
        if (finalised || std::uncaught_exceptions() > exceptions_) return;
        if (window_ != MPI_WIN_NULL) {
            MPI_Win_unlock_all(window_);
            MPI_Win_free(&window_);
        }
        if (node_ != MPI_COMM_NULL) MPI_Comm_free(&node_);
    }

    // Collective among the processes of the node. Messages of more than `longest` and those that do not fit into the
    // segment get none. Throws
    // std::logic_error where a message with a mailbox has another length for its receiver than for its sender.
    //
    // Every process has come here when one leaves, so all messages before are taken, and the memory of mailboxes that
    // are gone can be used again.
    Mailboxes open(std::span<const Message> outgoing, std::span<const Message> incoming) {
        ++opened_;
        std::size_t wanted = 0;
        for (const Message& message : outgoing)
            if (shared(message)) wanted += Mailbox::words(message.doubles);
        const std::size_t begin = wanted > 0 ? room_for(wanted) : words_;
        Mailboxes mailboxes;
        if (begin < words_) {
            mailboxes = Mailboxes(*this, begin);
            taken_[begin] = begin + wanted;
        }
        std::ranges::fill(announced_, Announcement{});
        std::size_t at = begin;
        const Mailbox::Word before = Mailbox::Word{opened_} << 32;
        for (const Message& message : outgoing) {
            const bool fits = shared(message) && begin < words_;
            mailboxes.outgoing_shared.push_back(fits);
            mailboxes.outgoing.emplace_back();
            if (!fits) continue;
            const auto member = static_cast<std::size_t>(members_.at(message.process));
            announced_[member] = {at, message.doubles};
            if (window_ != MPI_WIN_NULL)
                mailboxes.outgoing.back() = Mailbox(segments_[own_] + at, message.doubles, before);
            at += Mailbox::words(message.doubles);
        }
        if (members_.size() > 1)
            check_mpi(MPI_Alltoall(announced_.data(), 2, MPI_UINT64_T, known_.data(), 2, MPI_UINT64_T, node_),
                      "MPI_Alltoall");
        for (const Message& message : incoming) {
            mailboxes.incoming_shared.push_back(0);
            mailboxes.incoming.emplace_back();
            if (!shared(message)) continue;
            const auto member = static_cast<std::size_t>(members_.at(message.process));
            const auto [begins, doubles] = known_[member];
            if (begins == none) continue;
            if (doubles != message.doubles)
                throw std::logic_error("open: process " + std::to_string(message.process) + " sends " +
                                       std::to_string(doubles) + " doubles, expected are " +
                                       std::to_string(message.doubles));
            mailboxes.incoming_shared.back() = 1;
            if (window_ != MPI_WIN_NULL)
                mailboxes.incoming.back() = Mailbox(segments_[member] + begins, message.doubles, before);
        }
        return mailboxes;
    }

  private:
    // Doubles of a message. With 77 kB, two for each neighbour, iterates of 64,000 spheres are driven out of the cache:
    // 3 % of an accelerated iteration.
    static constexpr std::size_t longest = 4096;
    static constexpr Mailbox::Word none = ~Mailbox::Word{0};
    struct Announcement {  // to the receiver of a message
        Mailbox::Word begins = none, doubles = 0;
    };

    bool shared(const Message& message) const {
        return message.doubles <= longest && members_.contains(message.process);
    }

    // Where so many words are free, the first such place; words_ if there is none.
    std::size_t room_for(std::size_t wanted) const {
        std::size_t at = 0;
        for (const auto& [begin, end] : taken_) {
            if (begin - at >= wanted) return at;
            at = end;
        }
        return words_ - at >= wanted ? at : words_;
    }

    // Leaves window_ null if MPI cannot give the memory to one of the processes.
    void allocate() {
        MPI_Info apart = MPI_INFO_NULL;  // segments may lie apart, each begins a page
        check_mpi(MPI_Info_create(&apart), "MPI_Info_create");
        check_mpi(MPI_Info_set(apart, "alloc_shared_noncontig", "true"), "MPI_Info_set");
        Mailbox::Word* mine = nullptr;
        const int code = MPI_Win_allocate_shared(static_cast<MPI_Aint>(words_ * sizeof(Mailbox::Word)), 1, apart, node_,
                                                 static_cast<void*>(&mine), &window_);
        MPI_Info_free(&apart);
        int given = code == MPI_SUCCESS;
        check_mpi(MPI_Allreduce(MPI_IN_PLACE, &given, 1, MPI_INT, MPI_MIN, node_), "MPI_Allreduce");
        if (!given) {
            window_ = MPI_WIN_NULL;
            return;
        }
        check_mpi(MPI_Win_lock_all(MPI_MODE_NOCHECK, window_), "MPI_Win_lock_all");
        for (std::size_t m = 0; m < segments_.size(); ++m) {
            MPI_Aint size = 0;
            int unit = 0;
            check_mpi(
                MPI_Win_shared_query(window_, static_cast<int>(m), &size, &unit, static_cast<void*>(&segments_[m])),
                "MPI_Win_shared_query");
        }
        int own = 0;
        check_mpi(MPI_Comm_rank(node_, &own), "MPI_Comm_rank");
        own_ = static_cast<std::size_t>(own);
        // zeros, so that no flag is taken for one that was put: other memory may be given than that of a fresh page
        std::fill_n(mine, words_, Mailbox::Word{0});
        check_mpi(MPI_Barrier(node_), "MPI_Barrier");
    }

    std::size_t words_;                            // of a segment
    int exceptions_;                               // under way when this was made
    MPI_Comm node_ = MPI_COMM_NULL;                // processes that share memory
    std::map<int, int> members_;                   // of them: process, and its number in node_
    MPI_Win window_ = MPI_WIN_NULL;                // their memory, if they got it
    std::vector<Mailbox::Word*> segments_;         // by member
    std::size_t own_ = 0;                          // member that this process is
    std::map<std::size_t, std::size_t> taken_;     // words of the own segment: begin, end
    std::vector<Announcement> announced_, known_;  // by member: of the message to it, from it
    std::uint32_t opened_ = 0;
};

}  // namespace detail

}  // namespace nscdd
