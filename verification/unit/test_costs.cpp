// What counted work costs, between and beyond the sizes that were measured.
#include "files/costs.hpp"

#include "../catch.hpp"
#include "files/error.hpp"

using namespace nscdd;

TEST_CASE("costs go from one measured size to the next", "[costs]") {
    Costs costs;
    costs.units[static_cast<std::size_t>(Work::sweep)] = {{1e4, 4}, {1e6, 6}, {1e7, 9}};
    const auto ns = [&](double bytes) { return 1e9 * costs.seconds(Work::sweep, 10, bytes) / 10; };
    CHECK(ns(0) == Approx(4));
    CHECK(ns(1e4) == Approx(4));
    CHECK(ns(1e5) == Approx(5));  // half way of the logarithms
    CHECK(ns(1e6) == Approx(6));
    CHECK(ns(1e8) == Approx(9));
    CHECK(costs.seconds(Work::sweep, 0, 1e5) == 0);
    CHECK_THROWS_AS(costs.seconds(Work::driven, 1, 1e5), InputError);  // not measured
}
