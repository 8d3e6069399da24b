#include "app/profile_log.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/json_number.hpp"
#include "core/error.hpp"
#include "core/replace_file.hpp"
#include "core/text.hpp"

namespace pf {
namespace {

using nlohmann::json;

std::string finite_text(double value) { return std::isfinite(value) ? fmt::format("{:.9g}", value) : ""; }

}  // namespace

json profile_report(const FrameView& view) {
  if (view.profile == nullptr) return nullptr;
  json report = {{"axis", view.profile->shape.axis == ProfileAxis::x ? "x" : "radius"},
                 {"simulated_s", view.simulated_s}};
  for (const ProfileRow& row : rows_of(*view.profile, view.physics->parcels)) {
    report["position_m"].push_back(row.position_m);
    report["num"].push_back(row.num);
    report["area_fraction"].push_back(row.area_fraction);
    report["density_per_m2"].push_back(row.density_per_m2);
    report["velocity_mps"].push_back(number_or_null(row.velocity_mps));
    report["speed_mps"].push_back(number_or_null(row.speed_mps));
  }
  return report;
}

ProfileCsv::ProfileCsv(const std::filesystem::path& file)
    : stream_(standard_stream(file) != nullptr ? *standard_stream(file) : file_) {
  if (&stream_ == &file_) file_.open(file, std::ios::trunc);
  stream_ << "frame,simulated_s,position_m,num,area_fraction,density_per_m2,velocity_mps,speed_mps\n";
  if (!stream_) {
    throw UserError(
        fmt::format("--profile-csv: {} cannot be written; choose another file", in_quotes(file.string())));
  }
}

void ProfileCsv::add_frame(const FrameView& view) {
  if (view.profile != nullptr) {
    for (const ProfileRow& row : rows_of(*view.profile, view.physics->parcels)) {
      stream_ << fmt::format("{},{},{:.9g},{},{:.9g},{:.9g},{},{}\n", num_frames_, view.simulated_s,
                             row.position_m, row.num, row.area_fraction, row.density_per_m2,
                             finite_text(row.velocity_mps), finite_text(row.speed_mps));
    }
  }
  stream_.flush();
  ++num_frames_;
}

}  // namespace pf
