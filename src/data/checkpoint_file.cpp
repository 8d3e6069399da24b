#include "data/checkpoint_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/descriptor.hpp"
#include "core/error.hpp"
#include "core/link_target.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"
#include "data/run_state_json.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kMagic = "pickleflight checkpoint ";
constexpr int kFormat = 3;
constexpr std::size_t kMaxLineBytes = 1U << 20;

std::uint32_t crc_of(std::uint32_t crc, const void* data, std::size_t num_bytes) {
  if (num_bytes == 0) return crc;  // zlib's own would begin anew for a null pointer
  return static_cast<std::uint32_t>(::crc32_z(crc, static_cast<const Bytef*>(data), num_bytes));
}

// The arrays of a state with their names, in the order of the file.
template <class State, class Do>
void for_each_array(State& state, const Do& apply) {
  auto& backend = state.backend;
  apply("position", backend.parcels.position);
  apply("velocity", backend.parcels.velocity);
  apply("heated", backend.parcels.heated);
  apply("anchor", backend.exact.anchor);
  apply("tick", backend.exact.tick);
  apply("last_contact_tick", backend.exact.last_contact_tick);
  apply("path_m", state.flight.points_m);
  apply("path_s", state.flight.times_s);
}

// ---- writing

[[noreturn]] void fail(const fs::path& file, const std::string& reason) {
  throw UserError(fmt::format("{}: the checkpoint cannot be written: {}", in_quotes(file.string()), reason));
}

class Output {
 public:
  explicit Output(const fs::path& file)
      : file_(file), stream_(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
    if (!stream_.is_open()) fail();
  }

  void write(const void* data, std::size_t num_bytes) {
    crc_ = crc_of(crc_, data, num_bytes);
    if (!stream_.write(data, num_bytes)) fail();
  }
  void finish() {
    const std::uint32_t crc = crc_;
    write(&crc, sizeof crc);
    if (::fsync(stream_.get()) != 0 || !stream_.close()) fail();
  }

 private:
  [[noreturn]] void fail() const { pf::fail(file_, std::strerror(errno)); }
  fs::path file_;
  Descriptor stream_;
  std::uint32_t crc_ = 0;
};

void rename_to(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) fail(to, error.message());
}

// The rename is on the disk once its folder is.
void sync_folder(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY));
  if (opened.is_open()) ::fsync(opened.get());
}

struct Head {
  std::string text;  // three lines
  std::uint64_t num_bytes = 0;
};

Head head_of(const RunState& state) {
  json about = {{"program", PF_VERSION},
                {"state_hash", fmt::format("{:016x}", state_hash(state))},
                {"arrays", json::array()},
                {"num_bytes", std::string(20, ' ')}};
  std::uint64_t num_data_bytes = 0;
  for_each_array(state, [&](const char* name, const auto& array) {
    about["arrays"].push_back({{"name", name}, {"count", array.size()}, {"bytes_each", sizeof(array[0])}});
    num_data_bytes += array.size() * sizeof(array[0]);
  });
  const auto text = [&] {
    return fmt::format("{}{}\n{}\n{}\n", kMagic, kFormat, about.dump(), run_state_text(state, {}));
  };
  const std::uint64_t num_bytes = text().size() + num_data_bytes + sizeof(std::uint32_t);
  about["num_bytes"] = fmt::format("{:20}", num_bytes);
  return {text(), num_bytes};
}

// ---- reading

const char* why_unreadable(const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return "does not exist";
  if (fs::is_directory(file, ignored)) return "is a folder";
  if (fs::is_regular_file(file, ignored) && fs::is_empty(file, ignored)) return "is empty";
  return "cannot be read";
}

class Input {
 public:
  explicit Input(const fs::path& file) : name_(file.string()), stream_(file, std::ios::binary) {
    std::error_code error;
    size_ = fs::is_regular_file(file, error) ? fs::file_size(file, error) : 0;
    if (!stream_ || error || size_ == 0)
      refuse(why_unreadable(file), "give a file that --checkpoint or --dump FILE.h5 has written");
  }

  [[noreturn]] void refuse(const std::string& reason, const std::string& remedy) const {
    throw UserError(fmt::format("{}: {}; {}", in_quotes(name_), reason, remedy));
  }
  [[noreturn]] void refuse_damaged(const std::string& reason) const {
    refuse(reason, "give an earlier checkpoint, or a frame of a dump");
  }
  const std::string& name() const { return name_; }
  std::uint64_t size() const { return size_; }
  std::uint32_t crc() const { return crc_; }

  std::string line() {
    std::string text;
    for (char c = 0; text.size() < kMaxLineBytes && stream_.get(c) && c != '\n';) text.push_back(c);
    crc_ = crc_of(crc_, text.data(), text.size());
    crc_ = crc_of(crc_, "\n", 1);
    return text;
  }
  void read(void* to, std::size_t num_bytes) {
    stream_.read(static_cast<char*>(to), static_cast<std::streamsize>(num_bytes));
    if (!stream_) refuse_damaged("is cut off");
    crc_ = crc_of(crc_, to, num_bytes);
  }

 private:
  std::string name_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  std::uint32_t crc_ = 0;
};

void check_format(Input& input) {
  const std::string line = input.line();
  if (!line.starts_with(kMagic))
    input.refuse("is no checkpoint", "give a file that --checkpoint or --dump FILE.h5 has written");
  if (line != kMagic + std::to_string(kFormat)) {
    input.refuse(fmt::format("has format {}, and this program reads {}",
                             in_quotes(line.substr(std::strlen(kMagic))), kFormat),
                 "use the version of the program that wrote it");
  }
}

// Checks the file's size before anything of its content is believed, and sets the arrays' sizes.
void check_size(Input& input, const json& about, RunState& state) {
  const std::uint64_t wanted = std::stoull(about.at("num_bytes").get<std::string>());
  if (input.size() < wanted)
    input.refuse_damaged(fmt::format("is cut off: {} of {} bytes", input.size(), wanted));
  if (input.size() > wanted)
    input.refuse_damaged(fmt::format("has {} bytes too many", input.size() - wanted));
  std::size_t next = 0;
  for_each_array(state, [&](const char* name, auto& array) {
    const json& told = about.at("arrays").at(next++);
    const auto count = told.at("count").get<std::uint64_t>();
    const bool is_known = told.at("name") == name && told.at("bytes_each") == sizeof(array[0]);
    if (!is_known || count > wanted / sizeof(array[0]))
      input.refuse_damaged("is damaged: its arrays do not fit");
    array.resize(count);
  });
}

void check_consistent(const Input& input, const RunState& state, const std::string& hash) {
  const BackendState& b = state.backend;
  const std::size_t n = b.parcels.position.size();
  const auto wanted =
      state.settings.air == Air::parcels ? static_cast<std::size_t>(state.settings.num_parcels) : 0;
  const std::vector<std::uint32_t>& heated = b.parcels.heated;
  const bool is_ascending = std::ranges::adjacent_find(heated, std::ranges::greater_equal{}) == heated.end();
  const bool fits = n == wanted && b.parcels.velocity.size() == n &&
                    (heated.empty() || (is_ascending && heated.back() < n)) &&
                    b.exact.anchor.size() == b.exact.tick.size() &&
                    b.exact.anchor.size() == (b.exact.active ? n : 0) &&
                    (b.exact.last_contact_tick.empty() || b.exact.last_contact_tick.size() == n) &&
                    state.flight.points_m.size() == state.flight.times_s.size();
  if (!fits) input.refuse_damaged("is damaged: its arrays do not fit its settings");
  if (hash != fmt::format("{:016x}", state_hash(state)))
    input.refuse_damaged("is damaged: its state does not have the hash that it had");
}

}  // namespace

std::uint64_t write_checkpoint(const fs::path& named, const RunState& state) {
  const fs::path file = link_target(named);
  const fs::path aside = part_of(file);
  const Head head = head_of(state);
  try {
    Output output(aside);
    output.write(head.text.data(), head.text.size());
    for_each_array(state, [&](const char*, const auto& array) {
      output.write(array.data(), array.size() * sizeof(array[0]));
    });
    output.finish();
    rename_to(aside, file);
  } catch (const UserError&) {
    std::error_code ignored;
    fs::remove(aside, ignored);
    throw;
  }
  sync_folder(file);
  return head.num_bytes;
}

bool is_checkpoint(const fs::path& file) {
  std::string start(std::strlen(kMagic), '\0');
  std::ifstream(file, std::ios::binary).read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == kMagic;
}

RunState read_checkpoint(const fs::path& file) {
  Input input(file);
  check_format(input);
  const std::string about_line = input.line(), state_line = input.line();
  RunState arrays;
  std::string hash;
  try {
    const json about = json::parse(about_line);
    check_size(input, about, arrays);
    hash = about.at("state_hash").get<std::string>();
  } catch (const UserError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    input.refuse_damaged("is damaged: its second line cannot be read");
  }
  for_each_array(
      arrays, [&](const char*, auto& array) { input.read(array.data(), array.size() * sizeof(array[0])); });
  const std::uint32_t found = input.crc();
  std::uint32_t crc = 0;
  input.read(&crc, sizeof crc);
  if (found != crc) input.refuse_damaged("is damaged: its checksum is not that of its content");
  RunState state = run_state_from_text(state_line, {}, input.name(), std::move(arrays));
  check_consistent(input, state, hash);
  return state;
}

}  // namespace pf
