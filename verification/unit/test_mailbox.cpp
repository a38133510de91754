// Messages through shared memory (comm/mailbox.hpp), between threads.
#include <algorithm>
#include <numeric>
#include <thread>
#include <vector>

#include "../catch.hpp"
#include "nscdd/comm/mailbox.hpp"

using nscdd::detail::Mailbox;

namespace {

// Messages of changing lengths, each answered by one: how many doubles arrived that were not sent.
int wrong_after(int messages, std::size_t longest) {
    std::vector<nscdd::detail::Mailbox::Word> there(nscdd::detail::Mailbox::words(longest)),
        back(nscdd::detail::Mailbox::words(longest));
    const auto message = [longest](int k, int from) {
        std::vector<double> doubles(static_cast<std::size_t>(k) % (longest + 1));
        std::iota(doubles.begin(), doubles.end(), 1000.0 * k + from);
        return doubles;
    };
    const auto end = [&](std::vector<nscdd::detail::Mailbox::Word>& out, std::vector<nscdd::detail::Mailbox::Word>& in,
                         int own, int& wrong) {
        nscdd::detail::Mailbox to(out.data(), longest, 7), from(in.data(), longest, 7);
        std::vector<double> received(longest);
        for (int k = 0; k < messages; ++k) {
            to.put(message(k, own));
            const std::vector<double> expected = message(k, 1 - own);
            from.take(std::span(received).first(expected.size()));
            wrong += !std::ranges::equal(expected, std::span(received).first(expected.size()));
        }
    };
    int wrong = 0, theirs = 0;
    std::thread other([&] { end(back, there, 1, theirs); });
    end(there, back, 0, wrong);
    other.join();
    return wrong + theirs;
}

}  // namespace

TEST_CASE("two threads send each other messages through mailboxes, all arrive whole") {
    CHECK(wrong_after(2000, 5) == 0);
    CHECK(wrong_after(2000, 40) == 0);
    CHECK(wrong_after(100, 3000) == 0);
}

TEST_CASE("a message is there once it was put, also an empty one") {
    std::vector<nscdd::detail::Mailbox::Word> memory(nscdd::detail::Mailbox::words(3));
    nscdd::detail::Mailbox in(memory.data(), 3, 0), out(memory.data(), 3, 0);
    CHECK(in);
    CHECK(!nscdd::detail::Mailbox());
    CHECK(in.doubles() == 3);
    std::vector<double> received(3);
    for (const std::vector<double>& message : {std::vector<double>{1, 2, 3}, {}, {4}}) {
        CHECK(!in.there());
        out.put(message);
        CHECK(in.there());
        in.take(std::span(received).first(message.size()));
        CHECK(std::ranges::equal(message, std::span(received).first(message.size())));
    }
}

TEST_CASE("mailboxes that use memory again do not take what lies there for a message") {
    std::vector<nscdd::detail::Mailbox::Word> memory(nscdd::detail::Mailbox::words(2));
    const std::vector<double> message{1, 2};
    for (const nscdd::detail::Mailbox::Word before :
         {nscdd::detail::Mailbox::Word{1} << 32, nscdd::detail::Mailbox::Word{2} << 32}) {
        nscdd::detail::Mailbox out(memory.data(), 2, before), in(memory.data(), 2, before);
        std::vector<double> received(2);
        for (int k = 0; k < 3; ++k) {
            CHECK(!in.there());
            out.put(message);
            in.take(received);
        }
    }
}
