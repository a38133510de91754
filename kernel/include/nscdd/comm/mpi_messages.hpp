/// @file
/// A channel over MPI. Includes mpi.h, as mpi.hpp does.
#pragma once

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "nscdd/comm/mpi_node.hpp"
#include "nscdd/comm/mpi_process.hpp"
#include "nscdd/comm/rank_map.hpp"

namespace nscdd { inline namespace NSCDD_ABI { namespace detail {

/// One message to each process that this one sends to, and one from each that it receives from. What its own ranks send
/// each other is copied at finish(). Every message ends with a stamp, the time at which its sender called start().
/// Requests are not persistent: with Open MPI 4.1.4 calls for a message of up to 256 bytes then take half the time, for
/// others the same (reports/findings/two-cores.md).
class MpiMessages final : public Communicator::Channel {
  public:
    MpiMessages(MpiProcess& mpi, const std::vector<Communicator::Links>& links)
        : mpi_(mpi), layout_(mpi.hosted(), links, send_, recv_), tag_(mpi.next_channel_tag()) {
        for (std::size_t k = 0; k < links.size(); ++k)
            for (const Communicator::Link& link : links[k])
                if (link.peer != mpi.hosted().ranks()[k]) messages_ += 1, doubles_ += link.send;
        own_ = {take_own(layout_.outgoing), take_own(layout_.incoming)};
        if (own_.from.size() != own_.to.size())
            throw std::logic_error("open: process " + std::to_string(mpi.hosted().process()) + " sends its own ranks " +
                                   std::to_string(own_.from.size()) + " doubles, expected are " +
                                   std::to_string(own_.to.size()));
        mailboxes_ = mpi.node().open(sizes(layout_.outgoing), sizes(layout_.incoming));
        requests_.assign(layout_.incoming.size() + layout_.outgoing.size(), MPI_REQUEST_NULL);
        statuses_.resize(requests_.size());
    }

    void start() override {
        const double entry = mpi_.now();
        charge_calls(layout_.outgoing, mailboxes_.outgoing_shared);
        MPI_Request* request = requests_.data();
        for (std::size_t m = 0; m < layout_.incoming.size(); ++m, ++request) {
            if (mailboxes_.incoming[m]) continue;
            const auto& [process, message] = layout_.incoming[m];
            check_mpi(
                MPI_Irecv(message.data(), mpi_count(message.size()), MPI_DOUBLE, process, tag_, mpi_.comm(), request),
                "start");
        }
        for (std::size_t m = 0; m < layout_.outgoing.size(); ++m, ++request) {
            const auto& [process, message] = layout_.outgoing[m];
            message.back() = entry;
            if (detail::Mailbox& mailbox = mailboxes_.outgoing[m])
                mailbox.put(message);
            else
                check_mpi(MPI_Isend(message.data(), mpi_count(message.size()), MPI_DOUBLE, process, tag_, mpi_.comm(),
                                    request),
                          "start");
        }
        mpi_.count(operation_, messages_, doubles_);
        mpi_.spent(operation_, entry, entry);
    }
    /// Messages of MPI first, since they go on while something of MPI waits.
    void finish() override {
        const double entry = mpi_.now();
        // Waits for all requests even after an error: those under way still use our memory.
        int code = MPI_SUCCESS;
        for (std::size_t k = 0; k < requests_.size(); ++k) {
            if (requests_[k] == MPI_REQUEST_NULL) continue;
            const int failed = MPI_Wait(&requests_[k], &statuses_[k]);
            if (code == MPI_SUCCESS) code = failed;
        }
        check_mpi(code, "finish");
        std::ranges::copy(own_.from, own_.to.begin());
        if (!own_.from.empty()) mpi_.charge_call(own_.from.size(), true);
        double latest = entry;
        for (std::size_t m = 0; m < layout_.incoming.size(); ++m) {
            const auto& [process, message] = layout_.incoming[m];
            if (detail::Mailbox& mailbox = mailboxes_.incoming[m])
                mailbox.take(message);
            else
                check_length(statuses_[m], process, message.size());
            latest = (std::max)(latest, message.back());
        }
        charge_calls(layout_.incoming, mailboxes_.incoming_shared);
        mpi_.spent(operation_, entry, latest);
    }

  private:
    /// Takes the message of this process to itself out of a list, if there is one, without its stamp.
    std::span<double> take_own(std::vector<MessageLayout::Message>& messages) const {
        const auto own = std::ranges::find(messages, mpi_.hosted().process(), &MessageLayout::Message::process);
        if (own == messages.end()) return {};
        const std::span<double> doubles = own->doubles.first(own->doubles.size() - 1);
        messages.erase(own);
        return doubles;
    }
    static std::vector<NodeMemory::Message> sizes(const std::vector<MessageLayout::Message>& messages) {
        std::vector<NodeMemory::Message> sizes;
        for (const auto& [process, message] : messages) sizes.push_back({process, message.size()});
        return sizes;
    }
    void charge_calls(const std::vector<MessageLayout::Message>& messages, const std::vector<char>& shared) const {
        for (std::size_t m = 0; m < messages.size(); ++m) mpi_.charge_call(messages[m].doubles.size(), shared[m]);
    }
    void check_length(const MPI_Status& status, int process, std::size_t expected) const {
        int n = 0;
        check_mpi(MPI_Get_count(&status, MPI_DOUBLE, &n), "finish");
        if (n != mpi_count(expected))
            throw std::logic_error("finish: the message of process " + std::to_string(process) + " to process " +
                                   std::to_string(mpi_.hosted().process()) + " is shorter than expected");
    }

    MpiProcess& mpi_;
    MessageLayout layout_;
    struct Copy {
        std::span<double> from, to;
    } own_;  ///< what ranks of this process send each other
    NodeMemory::Mailboxes mailboxes_;
    int tag_;
    std::vector<MPI_Request> requests_;  ///< of incoming messages, then of outgoing ones; null for those with a mailbox
    std::vector<MPI_Status> statuses_;
    std::size_t messages_ = 0, doubles_ = 0;  ///< of all links between different ranks
};

}}}  // namespace nscdd::NSCDD_ABI::detail
