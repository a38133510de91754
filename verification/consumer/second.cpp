// A second translation unit with all of the kernel: the program links only if nothing in it is defined twice.
#include <nscdd/nscdd.hpp>

int jumps_of_two_copies() {
    nscdd::Copies copies{.dof = 3, .begin = {0, 2}};
    return static_cast<int>(nscdd::jump_matrix(copies).rows());
}
