#include "app/encoder.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "app/child_process.hpp"
#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const char* call, int error) {
  throw DeviceError(fmt::format("film: {} failed: {}", call, std::strerror(error)));
}

// An animated picture: its ffmpeg encoder, "" for a film.
std::string clip_encoder(const fs::path& file) {
  if (ending_of(file) == ".gif") return "gif";
  return ending_of(file) == ".webp" ? "libwebp_anim" : "";
}

bool is_mp4(const fs::path& file) { return ending_of(file) == ".mp4"; }

void check_file(const fs::path& file, int width_px, int height_px, double frame_rate_hz) {
  assert(width_px > 0 && height_px > 0 && frame_rate_hz > 0.0);
  (void)width_px, (void)height_px, (void)frame_rate_hz;
  const bool is_mkv = ending_of(file) == ".mkv";
  if (!is_mp4(file) && !is_mkv && clip_encoder(file).empty()) {
    throw UserError(
        fmt::format("film {}: the file must end in .mp4, .mkv, .gif or .webp", in_quotes(file.string())));
  }
  std::error_code ignored;
  if (file.has_parent_path() && !fs::is_directory(file.parent_path(), ignored)) {
    throw UserError(fmt::format("film {}: the folder {} does not exist; make it or choose another",
                                in_quotes(file.string()), in_quotes(file.parent_path().string())));
  }
  if (!ffmpeg_available()) {
    throw UserError(
        fmt::format("film {}: no ffmpeg on the PATH; install it (Debian, Ubuntu: apt install ffmpeg) "
                    "or record PNG frames: --record FOLDER/%05d.png",
                    in_quotes(file.string())));
  }
}

using Arguments = std::vector<std::string>;

constexpr const char* kHardware = "h264_nvenc";
constexpr const char* kSoftware = "libx264";

// Players assume BT.709 for films of this size. The film states it, too.
const std::string kToVideoColors = "scale=out_color_matrix=bt709:out_range=tv";
const Arguments kColors = {"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"};

// Without -xerror ffmpeg reports success even if the disk is full.
const Arguments kQuiet = {"ffmpeg", "-hide_banner", "-loglevel", "error", "-xerror", "-nostdin", "-y"};

// Constant quality, at which no loss is visible in moving parcels.
Arguments quality_of(const std::string& encoder) {
  if (encoder == kHardware) return {"-preset", "p4", "-rc", "vbr", "-cq", "20", "-b:v", "0"};
  return {"-preset", "veryfast", "-crf", "18"};
}

Arguments operator+(Arguments all, const Arguments& more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

// Raw frames through standard input.
Arguments input_arguments(int width_px, int height_px, double frame_rate_hz) {
  return {"-f",
          "rawvideo",
          "-pixel_format",
          "rgba",
          "-video_size",
          fmt::format("{}x{}", width_px, height_px),
          "-framerate",
          fmt::format("{}", frame_rate_hz),
          "-i",
          "pipe:0",
          "-an"};
}

// A GIF has 256 colours, chosen for what moves in it.
const std::string kGifColors =
    "vflip,format=rgb24,split[a][b];[a]palettegen=stats_mode=diff[p];"
    "[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle";

Arguments clip_arguments(const std::string& encoder) {
  if (encoder == "gif") return {"-vf", kGifColors, "-c:v", "gif", "-loop", "0"};
  return {"-vf", "vflip,format=rgb24", "-c:v", encoder, "-quality", "80", "-loop", "0"};
}

Arguments ffmpeg_arguments(const fs::path& file, int width_px, int height_px, double frame_rate_hz,
                           const std::string& encoder) {
  const Arguments input = input_arguments(width_px, height_px, frame_rate_hz);
  // Without "file:", ffmpeg would interpret a colon or a leading dash in the name.
  const Arguments output = {"-flush_packets", "1", "file:" + file.string()};
  if (!clip_encoder(file).empty()) return kQuiet + input + clip_arguments(encoder) + output;
  // yuv420p halves both sides, so that an odd side gets a black column or row.
  const bool is_odd = width_px % 2 != 0 || height_px % 2 != 0;
  const Arguments picture = {"-vf",
                             (is_odd ? "vflip,pad=ceil(iw/2)*2:ceil(ih/2)*2," : "vflip,") + kToVideoColors};
  // A fragment ends at a key frame. Frames after the last one are lost if ffmpeg dies.
  const Arguments frames = {"-c:v",     encoder,  "-g", fmt::format("{:.0f}", std::ceil(frame_rate_hz)),
                            "-pix_fmt", "yuv420p"};
  const Arguments mp4 = {"-movflags", "+frag_keyframe+empty_moov+default_base_moof", "-f", "mp4"};
  const Arguments mkv = {"-f", "matroska"};
  return kQuiet + input + picture + frames + kColors + quality_of(encoder) + (is_mp4(file) ? mp4 : mkv) +
         output;
}

bool encodes_trial(const std::string& encoder) {
  const Arguments trial = {"-f",        "lavfi", "-i",   "color=size=256x144:rate=30",
                           "-frames:v", "2",     "-c:v", encoder};
  ChildProcess ffmpeg(kQuiet + trial + quality_of(encoder) + Arguments{"-f", "null", "-"}, -1);
  return ffmpeg.wait().good;
}

}  // namespace

struct Encoder::Process {
  std::string file;
  std::string encoder;
  std::size_t frame_bytes = 0;
  // This end of ffmpeg's standard input. It is a socket, so that MSG_NOSIGNAL avoids SIGPIPE.
  Descriptor input;
  // Ctrl-C in the terminal ends this program alone. ffmpeg finishes the film at the end of its input.
  ChildProcess ffmpeg;
  bool was_killed = false;

  ChildExit end() {
    input.close();
    const ChildExit exit = ffmpeg.wait();
    was_killed = exit.code < 0;
    return exit;
  }

  [[noreturn]] void report_failure() {
    // Half a film can be seen, half a GIF or WebP is none.
    std::error_code ignored;
    if (!clip_encoder(file).empty() && fs::is_regular_file(file, ignored)) fs::remove(file, ignored);
    remove_if_empty(file);
    const char* how = was_killed ? "ffmpeg was killed" : "ffmpeg failed";
    throw DeviceError(fmt::format("film {}: {}: {}", in_quotes(file), how, ffmpeg.last_errors()));
  }
};

bool ffmpeg_available() {
  const char* path = std::getenv("PATH");
  std::string folders = path != nullptr ? path : "/bin:/usr/bin";
  folders += ':';
  for (std::size_t start = 0, end = 0; (end = folders.find(':', start)) != std::string::npos;
       start = end + 1) {
    const fs::path program = fs::path(end > start ? folders.substr(start, end - start) : ".") / "ffmpeg";
    std::error_code ignored;
    if (fs::is_regular_file(program, ignored) && ::access(program.c_str(), X_OK) == 0) return true;
  }
  return false;
}

std::string h264_encoder() {
  static std::mutex mutex;
  static std::map<std::string, std::string> found;  // by PATH
  const std::lock_guard lock(mutex);
  const char* path = std::getenv("PATH");
  std::string& encoder = found[path != nullptr ? path : ""];
  if (encoder.empty()) encoder = encodes_trial(kHardware) ? kHardware : kSoftware;
  return encoder;
}

Encoder::Encoder(const fs::path& file, int width_px, int height_px, double frame_rate_hz) {
  check_file(file, width_px, height_px, frame_rate_hz);
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) fail("socketpair", errno);
  Descriptor input(ends[0]);
  const Descriptor child_input(ends[1]);
  const std::size_t frame_bytes =
      4 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  const std::string clip = clip_encoder(file);
  const std::string encoder = clip.empty() ? h264_encoder() : clip;
  process_.reset(new Process{
      file.string(),
      encoder,
      frame_bytes,
      std::move(input),
      {ffmpeg_arguments(file, width_px, height_px, frame_rate_hz, encoder), child_input.get()},
  });
}

Encoder::~Encoder() {
  try {
    finish();
  } catch (const DeviceError&) {
    // A destructor cannot report it. Callers that need the result call finish().
  }
}

void Encoder::add_frame(std::span<const std::uint8_t> rgba) {
  assert(rgba.size() == process_->frame_bytes);
  if (!process_->ffmpeg.running()) process_->report_failure();
  while (!rgba.empty()) {
    const ssize_t sent = ::send(process_->input.get(), rgba.data(), rgba.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      rgba = rgba.subspan(static_cast<std::size_t>(sent));
    } else if (errno != EINTR) {
      process_->end();
      process_->report_failure();
    }
  }
}

void Encoder::finish() {
  if (!process_->ffmpeg.running()) return;
  if (!process_->end().good) process_->report_failure();
}

std::string Encoder::name() const { return process_->encoder; }

}  // namespace pf
