// What a user can get wrong, or a disk can: one line that names the thing and the place, printed as it is.
#pragma once

#include <stdexcept>

namespace nscdd {

// A scene, packing, state or option that cannot be used as given.
class InputError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

// A file that could not be written; whatever stood there before still does.
class OutputError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace nscdd
