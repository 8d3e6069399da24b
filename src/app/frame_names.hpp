// File names of films with their frames and logs, of pictures, clips and dumps.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace pf {

constexpr const char* kNullDevice = "/dev/null";  // a film to measure with

// True for a pattern of numbered PNG files, such as %05d.png: the name ends in .png and has one placeholder,
// %d or %0Nd with N from 1 to 9. The folder has none.
bool is_frame_pattern(const std::filesystem::path& file);

// File of frame `index`. pattern: is_frame_pattern() is true.
std::filesystem::path frame_file(const std::filesystem::path& pattern, int index);

// Number of the frame that the file would be by its name; none: it is no frame. Folders are not compared.
std::optional<int> frame_of(const std::filesystem::path& pattern, const std::filesystem::path& file);

// Pattern for the frames of a film without an encoder: flight.mp4 -> flight_frames/%05d.png.
std::filesystem::path frames_instead_of(const std::filesystem::path& film);

// Log of inputs of a film: flight.mp4.toml, or FOLDER.toml for the frames in FOLDER.
std::filesystem::path log_beside(const std::filesystem::path& film);

// Name of the file, beside a map of the panel, that counts the frames which took input.
std::filesystem::path frames_beside(const std::filesystem::path& panel_map);

// NAME.png, NAME-2.png, ...; for FOLDER/%05d.png the folder is numbered, `frames` where
// there is none.
std::filesystem::path numbered(const std::filesystem::path& file, int number);

// The first of these names that no file has.
std::filesystem::path free_name(const std::filesystem::path& file);

// A scene's name as part of a file's.
std::string file_part(std::string name);

}  // namespace pf
