// When accelerated iterations are tested: where their changes foretell that the test may pass.
#include <catch2/catch.hpp>

#include "nscdd/iterate/iteration.hpp"

using namespace nscdd;
using detail::Foretold;

namespace {

// Figures fall by `rate` an iteration from 1000 times their bounds on, and changes with them.
struct Falling {
    double rate;
    double foretold = 1;  // change of the figures over what the changes foretell, from a test on
    int from = 0;
    double figures(int iteration) const { return 1000 * std::pow(rate, iteration) * (iteration > from ? foretold : 1); }
    double change(int iteration) const { return 1e-7 * std::pow(rate, iteration); }
};

// Iterations at which tests come, to the first that passes; ten come before acceleration.
std::vector<int> tests(const Falling& of) {
    Foretold foretold;
    std::vector<int> at{10};
    foretold.tested(of.figures(10));
    for (int total = 10; of.figures(total) > 1;) {
        const int most = Foretold::longest(total);
        int count = 0;
        for (bool last = false; !last;) {
            last = ++count == most || foretold.due(count);
            const double change = of.change(total + count);
            foretold.changed(change * change);
        }
        at.push_back(total += count);
        foretold.tested(of.figures(total));
    }
    return at;
}

}  // namespace

TEST_CASE("a test comes where the changes foretell that it passes", "[quick]") {
    for (const double rate : {0.5, 0.8, 0.9}) {
        const int passes = int(std::ceil(std::log(1e-3) / std::log(rate)));
        CAPTURE(rate, passes);
        const std::vector<int> at = tests({rate});
        CHECK(at.back() >= passes);
        CHECK(at.back() <= (std::max)(passes + 2, 12));
        CHECK(at.size() <= 2 + std::size_t(passes / 10));
    }
}

TEST_CASE("tests come without being foretold, after twenty to fifty iterations", "[quick]") {
    CHECK(tests({0.99}).size() < 20);
    CHECK(Foretold::longest(0) == 20);
    CHECK(Foretold::longest(30) == 30);
    CHECK(Foretold::longest(100000) == 50);
    Foretold unknown;
    CHECK_FALSE(unknown.due(1000));
    unknown.changed(1e-3);
    CHECK_FALSE(unknown.due(1000));
}

TEST_CASE("no change foretells that the test passes", "[quick]") {
    Foretold still;
    still.tested(10);
    still.changed(0);
    CHECK(still.due(2));
}

TEST_CASE("where figures stay above what is foretold, tests become rare", "[quick]") {
    const std::vector<int> at = tests({.rate = 0.9, .foretold = 100, .from = 20});
    CHECK(at.size() < 16);
    Foretold foretold;
    foretold.tested(0.5);  // as one that fails for another reason
    foretold.changed(1);
    for (const int wait : {1, 2, 4, 8, 10, 10}) {
        CHECK_FALSE(foretold.due(wait));
        CHECK(foretold.due(wait + 1));
        foretold.tested(0.5);
    }
    foretold.tested(100);
    CHECK_FALSE(foretold.due(50));
}
