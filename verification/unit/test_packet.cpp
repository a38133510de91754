// Packets: the same bits on every machine.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include "../catch.hpp"
#include "nscdd/core/packet.hpp"

using namespace nscdd;

namespace {

// Positive numbers of any exponent that the operations allow, as packets.
void each_packet(int count, auto&& visit) {
    std::mt19937_64 random(1);
    for (int k = 0; k < count; ++k) {
        alignas(sizeof(Packet)) double lane[Packet::width];
        for (double& x : lane) {
            const std::uint64_t bits = random();
            x = std::ldexp(1 + double(bits >> 12) * 0x1p-52, int(bits % 1990) - 994);
        }
        visit(Packet::load(lane));
    }
}

std::array<double, std::size_t{Packet::width}> lanes(Packet a) {
    alignas(sizeof(Packet)) double lane[Packet::width];
    a.store(lane);
    std::array<double, std::size_t{Packet::width}> all;
    std::copy(std::begin(lane), std::end(lane), all.begin());
    return all;
}

}  // namespace

TEST_CASE("an inverse root is right to the last bit or two") {
    each_packet(1 << 14, [](Packet a) {
        const auto x = lanes(a), y = lanes(detail::inverse_root(a));
        for (std::size_t k = 0; k < x.size(); ++k) {
            const double exact = 1 / std::sqrt(x[k]);
            REQUIRE(std::abs(y[k] - exact) <= 3e-16 * exact);
        }
    });
}

TEST_CASE("packets have the bits of all machines with fused products") {
    if (!Packet::fuses) {
        WARN("skipped: this build rounds products before it adds");
        return;
    }
    std::uint64_t sum = 0;
    const auto add = [&sum](Packet a) {
        for (const double x : lanes(a)) {
            const auto bits = std::bit_cast<std::uint64_t>(x);
            sum += (bits ^ bits >> 31) * 1099511628211u;
        }
    };
    each_packet((1 << 17) / Packet::width, [&](Packet a) {
        const Packet root = detail::inverse_root(a);
        add(root);
        add(madd(root, a, Packet(0) - magnitude(a - root)));
        add(larger(a * root, Packet(1) / root) + smaller(a, root));
    });
    CHECK(sum == 0x5c118fb0841a8a50);
}
