/// @file
/// Memory that the processes of a node share, and the mailboxes in it (mailbox.hpp). Includes mpi.h, as mpi.hpp does.
#pragma once

#include <fcntl.h>
#include <mpi.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nscdd/comm/mailbox.hpp"

namespace nscdd { inline namespace NSCDD_ABI {

/// Ways of a message of the iteration from process to process within a node.
enum class WithinNode {
    memory,    ///< through memory that the processes share, where the system gives it and they fit; else as below
    messages,  ///< as messages of MPI
    modelled   ///< as messages of MPI, charged as if they went through memory: for simulated machines
};

namespace detail {

/// Throws std::runtime_error with the text of MPI unless the call went well.
inline void check_mpi(int code, const char* call) {
    if (code == MPI_SUCCESS) return;
    char text[MPI_MAX_ERROR_STRING];
    int length = 0;
    MPI_Error_string(code, text, &length);
    throw std::runtime_error(std::string(call) + ": " + std::string(text, static_cast<std::size_t>(length)));
}

/// Each process of a node has a segment of shared memory, in which the messages lie that it sends.
class NodeMemory {
  public:
    /// A message between this process and another one of the communicator.
    struct Message {
        int process;
        std::size_t doubles;  ///< at most
    };

    /// Mailboxes for messages to and from processes; must not outlive the memory.
    class Mailboxes {
      public:
        /// By place in the list that open() was given. An empty one: the message has to go as one of MPI.
        std::vector<detail::Mailbox> outgoing, incoming;
        /// By place in the lists: whether the message goes through memory, or is to be charged as if it did.
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

    /// For the processes of `comm` that share memory with this one, each with a segment of so many bytes. Collective.
    NodeMemory(MPI_Comm comm, WithinNode how, std::size_t bytes = std::size_t{1} << 20)
        : words_(how == WithinNode::messages ? 0 : bytes / sizeof(detail::Mailbox::Word)) {
        if (how == WithinNode::messages) return;
        int process = 0, members = 0;
        check_mpi(MPI_Comm_rank(comm, &process), "MPI_Comm_rank");
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
        open_ = shared_ || how == WithinNode::modelled;
    }
    NodeMemory(const NodeMemory&) = delete;
    NodeMemory& operator=(const NodeMemory&) = delete;
    ~NodeMemory() {
        release();
        int finalised = 0;
        MPI_Finalized(&finalised);
        if (!finalised && node_ != MPI_COMM_NULL) MPI_Comm_free(&node_);
    }

    /// Collective among the processes of the node. Messages of more than `longest` and those that do not fit into the
    /// segment get none. Throws std::logic_error where a message with a mailbox has another length for its receiver
    /// than for its sender.
    ///
    /// Every process has come here when one leaves, so all messages before are taken, and the memory of mailboxes that
    /// are gone can be used again.
    Mailboxes open(std::span<const Message> outgoing, std::span<const Message> incoming) {
        ++opened_;
        std::size_t wanted = 0;
        for (const Message& message : outgoing)
            if (shared(message)) wanted += detail::Mailbox::words(message.doubles);
        const std::size_t begin = wanted > 0 ? room_for(wanted) : words_;
        Mailboxes mailboxes;
        if (begin < words_) {
            mailboxes = Mailboxes(*this, begin);
            taken_[begin] = begin + wanted;
        }
        std::fill(announced_.begin(), announced_.end(), Announcement{});
        std::size_t at = begin;
        const detail::Mailbox::Word before = detail::Mailbox::Word{opened_} << 32;
        for (const Message& message : outgoing) {
            const bool fits = shared(message) && begin < words_;
            mailboxes.outgoing_shared.push_back(fits);
            mailboxes.outgoing.emplace_back();
            if (!fits) continue;
            const auto member = static_cast<std::size_t>(members_.at(message.process));
            announced_[member] = {at, message.doubles};
            if (shared_) mailboxes.outgoing.back() = detail::Mailbox(segments_[own_] + at, message.doubles, before);
            at += detail::Mailbox::words(message.doubles);
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
            if (shared_)
                mailboxes.incoming.back() = detail::Mailbox(segments_[member] + begins, message.doubles, before);
        }
        return mailboxes;
    }

  private:
    /// Doubles of a message. With 77 kB, two for each neighbour, iterates of 64,000 spheres are driven out of the
    /// cache: 3 % of an accelerated iteration.
    static constexpr std::size_t longest = 4096;
    static constexpr detail::Mailbox::Word none = ~detail::Mailbox::Word{0};
    /// To the receiver of a message.
    struct Announcement {
        detail::Mailbox::Word begins = none, doubles = 0;
    };

    bool shared(const Message& message) const {
        return open_ && message.doubles <= longest && members_.contains(message.process);
    }

    /// Where so many words are free, the first such place; words_ if there is none.
    std::size_t room_for(std::size_t wanted) const {
        std::size_t at = 0;
        for (const auto& [begin, end] : taken_) {
            if (begin - at >= wanted) return at;
            at = end;
        }
        return words_ - at >= wanted ? at : words_;
    }

    /// Every process makes its segment and maps those of the others. All or none have it afterwards: where one fails,
    /// all go without. Not by MPI_Win_allocate_shared: with Open MPI 4.1.4 a process that fails leaves the others
    /// waiting for it, and freeing the window is collective, which a process that meets an error cannot take part in.
    void allocate() {
        int own = 0;
        check_mpi(MPI_Comm_rank(node_, &own), "MPI_Comm_rank");
        own_ = static_cast<std::size_t>(own);
        using Name = std::array<char, 64>;
        Name name{};
        std::snprintf(name.data(), name.size(), "/nscdd-%ld-%p", static_cast<long>(getpid()),
                      static_cast<const void*>(this));
        int mapped = map(name.data(), true, segments_[own_]);
        const bool made = mapped;
        std::vector<Name> names(segments_.size());
        check_mpi(MPI_Allgather(name.data(), static_cast<int>(name.size()), MPI_CHAR, names.data(),
                                static_cast<int>(name.size()), MPI_CHAR, node_),
                  "MPI_Allgather");
        for (std::size_t m = 0; mapped && m < segments_.size(); ++m)
            if (m != own_) mapped = map(names[m].data(), false, segments_[m]);
        check_mpi(MPI_Allreduce(MPI_IN_PLACE, &mapped, 1, MPI_INT, MPI_MIN, node_), "MPI_Allreduce");
        if (made) shm_unlink(name.data());  // all have it who will ever have it
        shared_ = mapped;
        if (!shared_) release();
    }

    /// Maps a segment, made of zeros first if `make`. False if the system does not give it.
    bool map(const char* name, bool make, detail::Mailbox::Word*& segment) const {
        const std::size_t bytes = words_ * sizeof(detail::Mailbox::Word);
        rlimit largest{};  // of a file; beyond it the process would get a signal
        if (getrlimit(RLIMIT_FSIZE, &largest) == 0 && largest.rlim_cur < bytes) return false;
        const int file = shm_open(name, make ? O_CREAT | O_EXCL | O_RDWR : O_RDWR, 0600);
        if (file < 0) return false;
        const bool there = !make || posix_fallocate(file, 0, static_cast<off_t>(bytes)) == 0;
        void* const at = there ? mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0) : MAP_FAILED;
        close(file);
        if (at == MAP_FAILED) {
            if (make) shm_unlink(name);
            return false;
        }
        segment = static_cast<detail::Mailbox::Word*>(at);
        return true;
    }

    void release() {
        for (detail::Mailbox::Word*& segment : segments_) {
            if (segment) munmap(segment, words_ * sizeof(detail::Mailbox::Word));
            segment = nullptr;
        }
    }

    std::size_t words_;                             ///< of a segment
    MPI_Comm node_ = MPI_COMM_NULL;                 ///< processes that share memory
    std::map<int, int> members_;                    ///< of them: process, and its number in node_
    bool shared_ = false;                           ///< whether they have it
    bool open_ = false;                             ///< whether they have it, or it is modelled
    std::vector<detail::Mailbox::Word*> segments_;  ///< by member
    std::size_t own_ = 0;                           ///< member that this process is
    std::map<std::size_t, std::size_t> taken_;      ///< words of the own segment: begin, end
    std::vector<Announcement> announced_, known_;   ///< by member: of the message to it, from it
    std::uint32_t opened_ = 0;
};

}  // namespace detail

}}  // namespace nscdd::NSCDD_ABI
