// A second translation unit with all of the kernel: the program links only if nothing in it is defined twice.
#include <nscdd/nscdd.hpp>

int pairs_in_the_tree_of_six() { return nscdd::Communicator::tree_size(6); }
