// Names, extents and constant content of a dump. docs/data.md describes them.
#pragma once

#include "app/run_state.hpp"
#include "data/dump.hpp"
#include "data/h5.hpp"

namespace pf {

namespace dump_path {
constexpr const char* kPosition = "particles/parcels/position/value";
constexpr const char* kStep = "particles/parcels/position/step";
constexpr const char* kTime = "particles/parcels/position/time";
constexpr const char* kVelocity = "particles/parcels/velocity/value";
constexpr const char* kPresent = "particles/parcels/present/value";
constexpr const char* kUnits = "particles/parcels/position_units/value";
constexpr const char* kHeated = "particles/parcels/heated/value";
constexpr const char* kAnchor = "particles/parcels/anchor_units/value";
constexpr const char* kTick = "particles/parcels/anchor_tick/value";
constexpr const char* kContactTick = "particles/parcels/last_contact_tick/value";
constexpr const char* kEdges = "particles/parcels/box/edges/value";
constexpr const char* kBallPosition = "observables/ball_position/value";
constexpr const char* kBallVelocity = "observables/ball_velocity/value";
constexpr const char* kBallSpin = "observables/ball_spin/value";
constexpr const char* kEnergy = "observables/kinetic_energy/value";
constexpr const char* kHash = "observables/state_hash/value";
constexpr const char* kNumPresent = "observables/num_present/value";
constexpr const char* kCollisions = "observables/num_collisions/value";
constexpr const char* kHits = "observables/num_ball_hits/value";
constexpr const char* kRun = "observables/run_state/value";
constexpr const char* kSettings = "parameters/settings";
constexpr const char* kFormat = "parameters/format";
}  // namespace dump_path

constexpr std::int64_t kDumpFormat = 3;
constexpr std::size_t kRunTextBytes = 8192;  // of a frame's run_state

// Properties that do not change within a file.
struct DumpLayout {
  DumpFormat format;
  Settings settings;
  Physics physics;
  std::size_t num_parcels = 0;
  bool has_exact = false;          // anchors and ticks
  bool has_contact_ticks = false;  // ticks of last contacts

  // HDF5 has no empty chunks: a scene without parcels has one that is not present.
  std::size_t num_rows() const { return num_parcels == 0 ? 1 : num_parcels; }
};

DumpLayout layout_for(const RunState& state, const DumpFormat& format);

// Settings as one text. A line break within one is followed by a space, with which no setting begins.
std::string joined(const std::vector<std::string>& lines);
std::vector<std::string> lines_in(const std::string& text);  // the settings again

// Makes groups, empty data sets, attributes and parameters.
void fill_dump(hid_t file, const DumpLayout& layout);

}  // namespace pf
