#include "data/h5_layout.hpp"

#include "data/h5_fields.hpp"
#include "data/run_state_json.hpp"
#include "scene/derive.hpp"
#include "scene/scene_file.hpp"

namespace pf {
namespace {

using h5::Series;

class Filling {
 public:
  Filling(hid_t file, const DumpLayout& layout) : file_(file), layout_(layout) {}

  void add_about();
  void add_parcels();
  void add_observables();
  void add_parameters();

 private:
  // Groups on the way are made as needed. path: ELEMENT/value.
  void add_element(const std::string& path, hid_t type, std::vector<hsize_t> row, bool has_nan_fill = false);
  void add_box();
  void add_ids();
  void add_units();
  void add_numbers(hid_t parameters);

  hid_t file_;
  const DumpLayout& layout_;
  bool has_time_ = false;
};

void Filling::add_about() {
  const h5::Handle about = h5::make_group(file_, "h5md");
  h5::put_attribute(about.id(), "version", std::vector<int>{1, 1});
  const h5::Handle author = h5::make_group(about.id(), "author");
  h5::put_attribute(author.id(), "name", std::string("unknown"));
  const h5::Handle creator = h5::make_group(about.id(), "creator");
  h5::put_attribute(creator.id(), "name", std::string("pickleflight"));
  h5::put_attribute(creator.id(), "version", std::string(PF_VERSION));
}

// Readers expect step and time of their own in each element: hard links to one pair.
void Filling::add_element(const std::string& path, hid_t type, std::vector<hsize_t> row, bool has_nan_fill) {
  const std::string element = path.substr(0, path.rfind('/'));
  h5::make_groups(file_, element);
  const int compression = row.empty() ? 0 : layout_.format.compression;
  Series::make(file_, path, {type, std::move(row), compression, has_nan_fill});
  if (!has_time_) {
    Series::make(file_, dump_path::kStep, {H5T_NATIVE_INT64, {}, 0, false});
    Series::make(file_, dump_path::kTime, {H5T_NATIVE_DOUBLE, {}, 0, false});
    has_time_ = true;
    return;
  }
  for (const auto& [from, name] :
       {std::pair(dump_path::kStep, "/step"), std::pair(dump_path::kTime, "/time")}) {
    h5::checked(H5Lcreate_hard(file_, from, file_, (element + name).c_str(), H5P_DEFAULT, H5P_DEFAULT), name);
  }
}

void Filling::add_box() {
  const h5::Handle box = h5::make_groups(file_, "particles/parcels/box");
  h5::put_attribute(box.id(), "dimension", std::vector<int>{3});
  const std::string edge = layout_.physics.world.boundary == Boundary::periodic ? "periodic" : "none";
  h5::put_attribute(box.id(), "boundary", std::vector<std::string>{edge, edge, "none"});
  add_element(dump_path::kEdges, H5T_NATIVE_DOUBLE, {3, 3});
}

void Filling::add_ids() {
  std::vector<std::uint32_t> ids(layout_.num_rows());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::uint32_t>(i);
  const h5::Handle group(H5Gopen2(file_, "particles/parcels", H5P_DEFAULT), H5Gclose, "particles/parcels");
  h5::put_numbers(group.id(), "id", ids);
}

void Filling::add_parcels() {
  const hsize_t n = layout_.num_rows();
  add_element(dump_path::kPosition, H5T_NATIVE_FLOAT, {n, 3}, true);
  add_box();
  if (layout_.format.has_velocity) add_element(dump_path::kVelocity, H5T_NATIVE_FLOAT, {n, 3});
  add_element(dump_path::kPresent, H5T_NATIVE_UINT8, {n});
  if (layout_.format.has_state) {
    add_element(dump_path::kUnits, H5T_NATIVE_INT32, {n, 2});
    add_element(dump_path::kHeated, H5T_NATIVE_UINT8, {n});
  }
  if (layout_.has_exact) {
    add_element(dump_path::kAnchor, H5T_NATIVE_INT32, {n, 2});
    add_element(dump_path::kTick, H5T_NATIVE_UINT32, {n});
  }
  if (layout_.has_contact_ticks) add_element(dump_path::kContactTick, H5T_NATIVE_UINT32, {n});
  add_ids();
}

void Filling::add_observables() {
  if (layout_.physics.ball.exists) {
    add_element(dump_path::kBallPosition, H5T_NATIVE_DOUBLE, {2});
    add_element(dump_path::kBallVelocity, H5T_NATIVE_DOUBLE, {2});
    add_element(dump_path::kBallSpin, H5T_NATIVE_DOUBLE, {});
  }
  add_element(dump_path::kEnergy, H5T_NATIVE_DOUBLE, {});
  add_element(dump_path::kNumPresent, H5T_NATIVE_INT64, {});
  add_element(dump_path::kCollisions, H5T_NATIVE_INT64, {});
  add_element(dump_path::kHits, H5T_NATIVE_INT64, {});
  add_element(dump_path::kHash, H5T_NATIVE_UINT64, {});
  add_element(dump_path::kRun, h5::text_type(kRunTextBytes).id(), {});
}

void Filling::add_units() {
  const h5::Handle units = h5::make_groups(file_, "parameters/units");
  for (const auto& [what, unit] :
       {std::pair("length", "m"), std::pair("time", "s"), std::pair("velocity", "m s-1"),
        std::pair("mass", "kg"), std::pair("energy", "J"), std::pair("angular_velocity", "rad s-1")})
    h5::put_value(units.id(), what, std::string(unit));
}

void Filling::add_numbers(hid_t parameters) {
  const Physics& physics = layout_.physics;
  h5::put_value(parameters, "seed", static_cast<std::int64_t>(layout_.settings.seed));
  h5::put_value(parameters, "position_unit_m", physics.world.unit_m);
  h5::put_value(parameters, "parcel_radius_m", physics.parcels.radius_m);
  h5::put_value(parameters, "parcel_mass_kg", physics.parcels.mass_kg);
  h5::put_value(parameters, "restitution", physics.parcels.restitution);
  if (!physics.ball.exists) return;
  h5::put_value(parameters, "ball_radius_m", physics.ball.radius_m);
  h5::put_value(parameters, "ball_mass_kg", physics.ball.mass_kg);
}

void Filling::add_parameters() {
  add_units();
  const h5::Handle parameters(H5Gopen2(file_, "parameters", H5P_DEFAULT), H5Gclose, "parameters");
  h5::put_value(parameters.id(), "format", kDumpFormat);
  h5::put_value(parameters.id(), "program", std::string("pickleflight"));
  h5::put_value(parameters.id(), "version", std::string(PF_VERSION));
  h5::put_value(parameters.id(), "scene", scene_text(layout_.settings));
  h5::put_value(parameters.id(), "settings", joined(settings_lines(layout_.settings)));
  add_numbers(parameters.id());
}

}  // namespace

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    if (!text.empty()) text += '\n';
    for (const char c : line) {
      text += c;
      if (c == '\n') text += ' ';
    }
  }
  return text;
}

std::vector<std::string> lines_in(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
    end = text.find('\n', begin);
    const std::string line = text.substr(begin, end - begin);
    if (!lines.empty() && line.starts_with(' '))
      lines.back() += '\n' + line.substr(1);
    else
      lines.push_back(line);
  }
  return lines;
}

DumpLayout layout_for(const RunState& state, const DumpFormat& format) {
  DumpLayout layout{format, state.settings, derive_physics(state.settings),
                    state.backend.parcels.position.size()};
  layout.has_exact = format.has_state && state.settings.method == Method::exact;
  layout.has_contact_ticks = layout.has_exact && contact_clock_s(state.settings, layout.physics) > 0.0;
  return layout;
}

void fill_dump(hid_t file, const DumpLayout& layout) {
  Filling filling(file, layout);
  filling.add_about();
  filling.add_parcels();
  filling.add_observables();
  filling.add_parameters();
}

}  // namespace pf
