// Names of single frames: where a film is a folder of numbered pictures.
#pragma once

#include <filesystem>

namespace pf {

// Whether the name asks for numbered PNG files: it ends in .png and has one place for the number, %d or %0Nd
// with N from 1 to 9, as %05d.png. The folder has none.
bool is_frame_pattern(const std::filesystem::path& file);

// The file of frame `index`; the pattern must be one.
std::filesystem::path frame_file(const std::filesystem::path& pattern, int index);

// Where the frames of a film go if there is nothing to encode it with: flight.mp4 -> flight_frames/%05d.png.
std::filesystem::path frames_instead_of(const std::filesystem::path& film);

// The log of inputs of a film: flight.mp4.toml, or FOLDER.toml for the frames in FOLDER.
std::filesystem::path log_beside(const std::filesystem::path& film);

}  // namespace pf
