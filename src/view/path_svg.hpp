// Court, paths and ball as a drawing in metres.
#pragma once

#include <filesystem>
#include <string>

#include "app/simulation.hpp"
#include "view/look.hpp"

namespace pf {

// An SVG whose unit is the metre, y downwards: outline of the court or of the world, the paths of the current
// flight and of those that it is compared with, ghosts if they are shown, and the ball.
std::string path_svg(const FrameView& frame, const Look& look);

// Throws UserError if the file cannot be written.
void write_svg(const std::filesystem::path& file, const std::string& svg);

}  // namespace pf
