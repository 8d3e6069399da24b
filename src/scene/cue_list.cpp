#include "scene/cue_list.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/error.hpp"
#include "core/file_ending.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"
#include "scene/toml_document.hpp"

namespace pf {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKind = "list of cues";
constexpr const char* kBaseScene = "court";
constexpr std::size_t kMaxTitleBytes = 200;
constexpr std::size_t kMaxCues = 100;
constexpr double kMaxTitle_s = 3600.0;
constexpr double kMaxPlace_m = 1e6;

const std::vector<std::string> kKeys = {"title", "subtitle", "title_s", "scene", "camera", "paused",
                                        "world", "air",      "ball",    "run",   "view"};

// Film and threads go on when the cue changes.
bool holds_for_the_run(const Field& field) {
  return field.path() == "run.threads" || field.path() == "run.frame_rate_hz";
}

// Reads one [[cue]].
class CueReader {
 public:
  CueReader(const fs::path& file, const toml::table& table) : file_(file), table_(table) {}

  Cue read();

 private:
  [[noreturn]] void refuse(const toml::node& node, const std::string& reason) const {
    throw UserError(fmt::format("{}: {}", place_of(file_, node.source()), reason));
  }
  void check_keys() const;
  std::string text(const char* key) const;
  double number(const toml::node& node, const char* name, double low, double high) const;
  Settings scene() const;
  void read_section(const std::string& section, const toml::table& table, Settings& settings) const;
  std::optional<CueView> camera() const;
  CueView view(const toml::table& table) const;

  const fs::path& file_;
  const toml::table& table_;
};

void CueReader::check_keys() const {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    if (std::find(kKeys.begin(), kKeys.end(), name) != kKeys.end()) continue;
    throw UserError(
        fmt::format("{}: {} is not a key of a cue{}; keys: {}; settings as in a scene file, as "
                    "air.restitution = 0.9",
                    place_of(file_, key.source()), in_quotes(name),
                    say_nearest("; the nearest is ", name, kKeys), fmt::join(kKeys, ", ")));
  }
}

std::string CueReader::text(const char* key) const {
  const toml::node* node = table_.get(key);
  if (node == nullptr) return "";
  const auto value = node->value<std::string>();
  if (!node->is_string() || value->size() > kMaxTitleBytes) {
    refuse(*node, fmt::format("{} takes a text in quotes of at most {} bytes, as {} = \"Without spin\"", key,
                              kMaxTitleBytes, key));
  }
  return *value;
}

double CueReader::number(const toml::node& node, const char* name, double low, double high) const {
  const auto value = node.value<double>();
  if (!value || !node.is_number() || !(*value >= low && *value <= high))  // none: an integer beyond 2^53
    refuse(node, fmt::format("{} takes a number from {} to {} without quotes", name, limit_text(low),
                             limit_text(high)));
  return *value;
}

// A scene's file may lie beside the list.
Settings CueReader::scene() const {
  const toml::node* node = table_.get("scene");
  if (node == nullptr) return load_scene(kBaseScene);
  const auto name = node->value<std::string>();
  if (!node->is_string() || name->empty())
    refuse(*node,
           "scene takes the name of a scene in quotes, or a file ending in .toml, as scene = \"court\"");
  try {
    const fs::path beside = file_.parent_path() / *name;
    return load_scene(ending_of(*name) == ".toml" ? beside.string() : *name);
  } catch (const UserError& error) {
    refuse(*node, fmt::format("scene: {}", error.what()));
  }
}

void CueReader::read_section(const std::string& section, const toml::table& table, Settings& settings) const {
  for (const auto& [key, node] : table) {
    const std::string where = place_of(file_, key.source());
    const Field& field = find_field(fmt::format("{}.{}", section, key.str()), where);
    if (holds_for_the_run(field)) {
      throw UserError(fmt::format("{}: {} holds for the whole run; leave it out and give --set {}={}", where,
                                  field.path(), field.path(), value_text(field, Settings{})));
    }
    set_from_node(field, node, settings, where);
  }
}

CueView CueReader::view(const toml::table& table) const {
  const toml::node* center = table.get("center_m");
  const toml::node* width = table.get("width_m");
  const toml::array* parts = center == nullptr ? nullptr : center->as_array();
  if (table.size() != 2 || width == nullptr || parts == nullptr || parts->size() != 2) {
    refuse(table,
           "camera takes \"fit\", or the middle and the width of what is seen, in metres, as camera = "
           "{ center_m = [-4, 0], width_m = 5 }");
  }
  return {{number(*parts->get(0), "center_m", -kMaxPlace_m, kMaxPlace_m),
           number(*parts->get(1), "center_m", -kMaxPlace_m, kMaxPlace_m)},
          number(*width, "width_m", 1e-6, kMaxPlace_m)};
}

std::optional<CueView> CueReader::camera() const {
  const toml::node* node = table_.get("camera");
  if (node == nullptr) return std::nullopt;
  if (node->is_table()) return view(*node->as_table());
  if (node->value<std::string>() != "fit")
    refuse(*node, "camera takes \"fit\", or a place as { center_m = [-4, 0], width_m = 5 }");
  return std::nullopt;
}

Cue CueReader::read() {
  check_keys();
  Cue cue;
  cue.place = place_of(file_, table_.source());
  cue.title = text("title");
  cue.subtitle = text("subtitle");
  if (const toml::node* node = table_.get("title_s"))
    cue.title_s = number(*node, "title_s", 0.0, kMaxTitle_s);
  cue.camera = camera();
  if (const toml::node* node = table_.get("paused")) {
    if (!node->is_boolean()) refuse(*node, "paused takes true or false");
    cue.paused = *node->value<bool>();
  }
  cue.settings = scene();
  for (const char* section : {"world", "air", "ball", "run", "view"}) {
    const toml::node* node = table_.get(section);
    if (node == nullptr) continue;
    if (!node->is_table())
      refuse(*node, fmt::format("{} is a section; name a setting of it, as in a scene file", section));
    read_section(section, *node->as_table(), cue.settings);
  }
  check_cue(cue);
  return cue;
}

std::vector<std::string> known_lists() {
  std::vector<std::string> names;
  for (const SceneEntry& list : list_assets("cues")) names.push_back(list.name);
  return names;
}

fs::path file_of(const std::string& name_or_path) {
  if (ending_of(name_or_path) == ".toml") return name_or_path;
  const std::vector<std::string> known = known_lists();
  const fs::path file = fs::path("cues") / (name_or_path + ".toml");
  if (known.empty() || std::find(known.begin(), known.end(), name_or_path) != known.end())
    return find_asset(file);  // or names the folders
  throw UserError(fmt::format("{} is no {}{}; known: {}; or give a file ending in .toml",
                              in_quotes(name_or_path), kKind,
                              say_nearest("; the nearest is ", name_or_path, known), fmt::join(known, ", ")));
}

// The scene that a cue of these settings is written on top of.
Settings base_of(const Settings& settings) {
  for (const SceneEntry& scene : list_scenes()) {
    if (scene.name == settings.name) return load_scene_file(scene.file);
  }
  return load_scene(kBaseScene);
}

// A number of parcels that the backend chooses is not written.
bool is_written(const Field& field, const Settings& settings, const Settings& base,
                const std::string& backend) {
  if (field.section == "scene" || holds_for_the_run(field)) return false;
  const bool is_chosen_by_backend = field.path() == "air.num_parcels" && base.num_parcels == 0 &&
                                    settings.num_parcels == resolve_num_parcels(base, backend);
  return !is_chosen_by_backend && !is_same(field, settings, base);
}

std::string setting_line(const Field& field, const Settings& settings) {
  const bool is_name = std::holds_alternative<Choice>(field.member);
  const std::string value = value_text(field, settings);
  return fmt::format("{} = {}\n", field.path(), is_name ? toml_string(value) : value);
}

CueList read_cues(const fs::path& file, const std::string& text) {
  CueList list{file, {}};
  const toml::table document = parse_text(text, file);
  const toml::array* cues = document.contains("cue") ? document.get("cue")->as_array() : nullptr;
  if (cues == nullptr || cues->empty() || cues->size() > kMaxCues) {
    throw UserError(
        fmt::format("{}: is not a list of cues, which has 1 to {} of [[cue]], each with a title as "
                    "title = \"Without spin\"",
                    list.file.string(), kMaxCues));
  }
  for (const auto& [key, node] : document) {
    if (key.str() == "cue") continue;
    throw UserError(fmt::format("{}: {} stands outside of a cue; move it below a [[cue]]",
                                place_of(list.file, key.source()), in_quotes(std::string(key.str()))));
  }
  for (const toml::node& node : *cues) {
    if (!node.is_table())
      throw UserError(
          fmt::format("{}: a cue is a table, written [[cue]]", place_of(list.file, node.source())));
    list.cues.push_back(CueReader(list.file, *node.as_table()).read());
  }
  return list;
}

// Throws UserError if a list with the cue added could not be loaded: a camera may look at more, and a title
// be longer, than a list takes, and a list written as cue = [...] takes none.
void check_added(const fs::path& file, const std::string& text) {
  if (text.size() > kMaxDocumentBytes) {
    throw UserError(fmt::format("{} would be larger than {} MiB with this cue; choose another file",
                                in_quotes(file.string()), kMaxDocumentBytes >> 20));
  }
  try {
    read_cues(file, text);
  } catch (const UserError& error) {
    throw UserError(
        fmt::format("the cue is not saved, since the list could not be loaded then: {}", error.what()));
  }
}

}  // namespace

CueList load_cue_list(const std::string& name_or_path) {
  const fs::path file = file_of(name_or_path);
  return read_cues(file, read_document(file, kKind));
}

bool is_cue_list(const fs::path& file) {
  try {
    std::istringstream lines(read_document(file, kKind));
    for (std::string line; std::getline(lines, line);) {
      std::erase_if(line, [](char c) { return c == ' ' || c == '\t'; });
      if (line.starts_with("[[cue]]")) return true;
    }
  } catch (const UserError&) {
    return false;
  }
  return false;
}

void check_cue(const Cue& cue) {
  try {
    Settings with = cue.settings;
    const bool is_open = with.air == Air::parcels && with.num_parcels == 0;
    for (const std::int64_t num : {with.num_parcels_cpu, with.num_parcels_gpu}) {
      if (is_open) with.num_parcels = num;
      const Spawner tried(with, derive_physics(with), initial_ball(with));
      if (!is_open) break;
    }
  } catch (const UserError& error) {
    throw UserError(fmt::format("{}: this cue cannot run: {}", cue.place, error.what()));
  }
}

std::string cue_text(const Cue& cue, const std::string& backend) {
  const Settings base = base_of(cue.settings);
  std::string text = fmt::format("\n[[cue]]\ntitle = {}\n", toml_string(cue.title));
  if (!cue.subtitle.empty()) text += fmt::format("subtitle = {}\n", toml_string(cue.subtitle));
  if (cue.title_s != kTitle_s) text += fmt::format("title_s = {}\n", cue.title_s);
  text += fmt::format("scene = {}\n", toml_string(base.name));
  for (const Field& field : fields()) {
    if (is_written(field, cue.settings, base, backend)) text += setting_line(field, cue.settings);
  }
  if (cue.camera) {
    const auto& [center_m, width_m] = *cue.camera;
    text += fmt::format("camera = {{ center_m = [{:.6g}, {:.6g}], width_m = {:.6g} }}\n", center_m.x,
                        center_m.y, width_m);
  }
  if (cue.paused) text += "paused = true\n";
  return text;
}

void append_cue(const fs::path& file, const Cue& cue, const std::string& backend) {
  std::error_code ignored;
  const bool is_new = !fs::exists(fs::symlink_status(file, ignored));
  std::string text = "# Cues of a talk. Start it with: pickleflight run --cues THIS_FILE\n";
  if (!is_new) {
    text = read_document(file, kKind);
    if (read_cues(file, text).cues.size() == kMaxCues)
      throw UserError(
          fmt::format("{} has {} cues already; choose another file", in_quotes(file.string()), kMaxCues));
    if (!text.ends_with('\n')) text += '\n';
  }
  text += cue_text(cue, backend);
  check_added(file, text);
  const std::string problem = replace_file(file, text);
  if (!problem.empty()) {
    throw OutputError(fmt::format(
        "{}: the cue cannot be written ({}); choose a file in a folder that exists, is writable and has room",
        in_quotes(file.string()), problem));
  }
}

}  // namespace pf
