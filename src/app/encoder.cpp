// The ffmpeg process: started without a shell, fed through a socket, its complaints kept for the message.
#include "app/encoder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/text.hpp"

extern char** environ;

namespace pf {
namespace {

namespace fs = std::filesystem;

// Owner of a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() { close(); }
  int get() const { return fd_; }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

 private:
  int fd_;
};

[[noreturn]] void fail(const char* call, int error) {
  throw DeviceError(fmt::format("film: {} failed: {}", call, std::strerror(error)));
}

bool is_mp4(const fs::path& file) { return file.extension() == ".mp4" || file.extension() == ".MP4"; }

void check_file(const fs::path& file, int width_px, int height_px, double frame_rate_hz) {
  assert(width_px > 0 && height_px > 0 && frame_rate_hz > 0.0);
  (void)width_px, (void)height_px, (void)frame_rate_hz;
  const bool is_mkv = file.extension() == ".mkv" || file.extension() == ".MKV";
  if (!is_mp4(file) && !is_mkv) {
    throw UserError(fmt::format("film {}: the file must end in .mp4 or .mkv", in_quotes(file.string())));
  }
  std::error_code ignored;
  if (file.has_parent_path() && !fs::is_directory(file.parent_path(), ignored)) {
    throw UserError(fmt::format("film {}: the folder {} does not exist; make it or choose another",
                                in_quotes(file.string()), in_quotes(file.parent_path().string())));
  }
  if (!ffmpeg_available()) {
    throw UserError(
        fmt::format("film {}: no ffmpeg on the PATH; install it (Debian, Ubuntu: apt install ffmpeg) "
                    "or leave out --record",
                    in_quotes(file.string())));
  }
}

std::vector<std::string> ffmpeg_arguments(const fs::path& file, int width_px, int height_px,
                                          double frame_rate_hz) {
  // yuv420p halves both sides, so odd ones get a black column or row.
  const bool is_odd = width_px % 2 != 0 || height_px % 2 != 0;
  std::vector<std::string> arguments = {"ffmpeg",
                                        "-hide_banner",
                                        "-loglevel",
                                        "error",
                                        "-nostdin",
                                        "-y",
                                        "-f",
                                        "rawvideo",
                                        "-pixel_format",
                                        "rgba",
                                        "-video_size",
                                        fmt::format("{}x{}", width_px, height_px),
                                        "-framerate",
                                        fmt::format("{}", frame_rate_hz),
                                        "-i",
                                        "pipe:0",
                                        "-an",
                                        "-vf",
                                        is_odd ? "vflip,pad=ceil(iw/2)*2:ceil(ih/2)*2" : "vflip",
                                        "-c:v",
                                        "libx264",
                                        "-preset",
                                        "veryfast",
                                        "-crf",
                                        "18",
                                        "-pix_fmt",
                                        "yuv420p"};
  if (is_mp4(file)) {
    arguments.insert(arguments.end(),
                     {"-movflags", "+frag_keyframe+empty_moov+default_base_moof", "-f", "mp4"});
  } else {
    arguments.insert(arguments.end(), {"-f", "matroska"});
  }
  arguments.push_back("file:" + file.string());  // else a colon or a leading dash in the name has a meaning
  return arguments;
}

// Starts ffmpeg with the given standard input and error. In a process group of its own: Ctrl-C in the
// terminal then ends the program only, and ffmpeg finishes the film at the end of its input.
pid_t spawn_ffmpeg(std::vector<std::string> arguments, int input, int errors) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, errors, STDERR_FILENO);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  pid_t pid = -1;
  const int error = posix_spawnp(&pid, "ffmpeg", &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) fail("starting ffmpeg", error);
  return pid;
}

// The last lines that ffmpeg wrote, joined to one.
std::string last_words(int errors) {
  constexpr off_t kMostBytes = 600;
  const off_t end = ::lseek(errors, 0, SEEK_END);
  if (end <= 0) return "it said nothing";
  const off_t begin = end > kMostBytes ? end - kMostBytes : 0;
  std::string text(static_cast<std::size_t>(end - begin), '\0');
  const ssize_t got = ::pread(errors, text.data(), text.size(), begin);
  text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) text.replace(at, 1, "; ");
  return text;
}

}  // namespace

struct Encoder::Process {
  std::string file;
  pid_t pid = -1;  // -1: ended
  std::size_t frame_bytes = 0;
  Descriptor input;   // our end of ffmpeg's standard input: a socket, so that MSG_NOSIGNAL spares the handler
                      // of SIGPIPE
  Descriptor errors;  // memory that holds ffmpeg's standard error: no pipe that could fill up

  // Ends the input and waits; the exit status of the process, as of waitpid.
  int end() {
    input.close();
    int status = 0;
    while (::waitpid(pid, &status, 0) < 0) {
      if (errno == EINTR) continue;
      pid = -1;
      fail("waitpid", errno);
    }
    pid = -1;
    return status;
  }

  [[noreturn]] void report_failure() {
    throw DeviceError(fmt::format("film {}: ffmpeg failed: {}", in_quotes(file), last_words(errors.get())));
  }
};

bool ffmpeg_available() {
  const char* path = std::getenv("PATH");
  std::string folders = path != nullptr ? path : "/bin:/usr/bin";
  folders += ':';
  for (std::size_t begin = 0, end = 0; (end = folders.find(':', begin)) != std::string::npos;
       begin = end + 1) {
    const fs::path program = fs::path(end > begin ? folders.substr(begin, end - begin) : ".") / "ffmpeg";
    std::error_code ignored;
    if (fs::is_regular_file(program, ignored) && ::access(program.c_str(), X_OK) == 0) return true;
  }
  return false;
}

Encoder::Encoder(const fs::path& file, int width_px, int height_px, double frame_rate_hz) {
  check_file(file, width_px, height_px, frame_rate_hz);
  process_ = std::make_unique<Process>();
  process_->file = file.string();
  process_->frame_bytes = 4 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) fail("socketpair", errno);
  process_->input = Descriptor(ends[0]);
  const Descriptor child_input(ends[1]);
  process_->errors = Descriptor(::memfd_create("ffmpeg-errors", MFD_CLOEXEC));
  if (process_->errors.get() < 0) fail("memfd_create", errno);
  process_->pid = spawn_ffmpeg(ffmpeg_arguments(file, width_px, height_px, frame_rate_hz), child_input.get(),
                               process_->errors.get());
}

Encoder::~Encoder() {
  try {
    finish();
  } catch (const DeviceError&) {
    // Nobody is left to tell; who wants to know calls finish.
  }
}

void Encoder::add_frame(std::span<const std::uint8_t> rgba) {
  assert(rgba.size() == process_->frame_bytes);
  if (process_->pid < 0) process_->report_failure();
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
  if (process_->pid < 0) return;
  const int status = process_->end();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) process_->report_failure();
}

}  // namespace pf
