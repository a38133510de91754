// A scene in memory, as the Python module makes it.
#pragma once

#include "files/toml_table.hpp"
#include "model/scene.hpp"

namespace nscdd {

// Reads a scene as read_scene() does, with `name` in the place of a file and its lines.
Scene scene_of(toml::table table, const std::string& name);

}  // namespace nscdd
