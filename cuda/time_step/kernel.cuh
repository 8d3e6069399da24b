// The kernels of the time-stepped methods. A step is done in one of three ways, with the same bits.
//
// For few parcels step_kernel does a whole step with a thread for each, in the order of the last sort: it
// searches the cells that the parcel's search box covers, sums its contacts, moves it, and in the last step
// of a frame writes what is drawn. It reads from arrays that it does not write. A launch is its main cost
// where parcels are few. If a sort is due, such a step does it on its way: count_for_sort_kernel counts the
// parcels by the cells that they are in before the step, CUB sums the counts, and step_kernel puts each
// parcel, moved, in its place.
//
// Where many parcels touch, as they do before a ball, step_of_block_kernel does the same, but a block works
// off the contacts of its parcels together. Of very many a thread has two, which are searched around at once.
//
// For many that seldom touch three kernels do it, with fewer instructions: find_pairs_kernel (or in
// large runs find_pairs_of_two_kernel) finds each pair that touches once, contact_kernel sums their contacts,
// and move_kernel moves all parcels in place and draws. For a sort, the first kernel does what
// count_for_sort_kernel does, clear_few_kernel and CUB follow, and sort_move_kernel puts each parcel in its
// place. A sort of its own reads and writes twice as many bytes.
//
// Steps are open until a kernel ends them, up to kMaxOpenSteps at a time. A ball has to move after each step.
// So with one a step of one kernel is ended at once, and a step in parts without contacts, too. Other steps
// in parts stay open: the first block of the next contact_kernel moves the ball while the others sum
// contacts.
//
// All sums are integers, so the results do not depend on the order of threads. The stream comes last.
#pragma once

#include <algorithm>

#include "backend/draw_buffers.hpp"
#include "cuda/cell_sort.cuh"
#include "cuda/circle_search.cuh"
#include "cuda/parcel_arrays.cuh"
#include "cuda/time_step/state.cuh"
#include "model/kinetic_theory.hpp"
#include "model/parcel.hpp"

namespace pf {

// Size of the cells, and widest reach of the search box before a sort pays off, in contact distances. Cells
// of a row that a box covers are one range, so narrow ones cost nothing but their counts. Measured on an
// H100, Gps of a gas of 10^7, area fraction 0.2 and 0.35, and ms a frame of the court of 10^7: width 1.25,
// height 3.5, reach 3.0 26.8, 20.9, 9.11; reach 2.75 26.8, 21.0, 9.34; 3.25 26.7, 20.6, 9.12; width 1.5,
// reach 2.75 26.8, 20.9, 9.37; with height 3.0 26.4, 20.6, 9.33. Steps in parts that sort on their way, on an
// H200: reach 3.0 33.7, 27.8, 8.22, and 35.0 at 10^8; 3.25 33.8, 27.8, 8.21, and 35.6.
constexpr double kStepCellWidth = 1.25, kStepCellHeight = 3.5;
// In a dense gas cells are narrower, this over the area fraction, so that they hold 1.1 parcels as before.
// Gps of 10^7 with wide and with narrow ones, area fraction 0.35 33.1 and 33.2, `spring` 28.2 and 28.9;
// 0.5 26.7 and 27.5; 0.65 18.3 and 19.4, `spring` 20.5 and 21.9.
constexpr double kStepCellWidthInGas = 0.25, kMinStepCellWidth = 0.5;
constexpr double kWidestStepReach = 3.0, kWidestReachInParts = 3.25;
// Of steps of step_of_block_kernel. With two parcels to a thread, Gps of `spring` and of `impulse` at area
// fraction 0.65, 10^7 on an H200: 2.5 32.3, 16.6; 2.75 32.4, 16.6; 3.0 32.2, 15.5; 3.25 31.6, 15.4.
constexpr double kWidestReachOfBlock = 2.75;

inline CellSize step_cells(const StepConstants& constants) {
  const double in_gas = kStepCellWidthInGas / area_fraction_of(constants.physics);
  const double width = std::clamp(in_gas, kMinStepCellWidth, kStepCellWidth);
  return {width * constants.contact_distance, kDeviceCellsPerParcel,
          kStepCellHeight * constants.contact_distance};
}

// Widest reach of the search in a step that sorts, which is in the order before. Beyond it, as after steps
// without contacts or in very long ones, a sort of its own comes first.
constexpr double kWidestReachToSort = 4.0;

// From so many parcels on, and without a ball up to such an area fraction, three kernels are faster than one.
// H200, Gps of three and of one: 5 10^5 22.0 and 21.9, 6 10^5 23.8 and 22.8, 7 10^5 25.7 and 23.4; at area
// fraction 0.44 and 0.48 10^6 20.8 and 19.8, 18.5 and 19.0; 10^7 27.8 and 26.8, 25.1 and 25.8. `spring` has
// ten times as many contacts: H100, 10^7 14.3 and 21.5. With a ball, ms a frame of the court: 2 10^5 0.56 and
// 0.54, 2.5 10^5 0.57 and 0.57, 3 10^5 0.61 and 0.65; 10^6 at area fraction 0.6 1.56 and 1.67, at 0.7 1.71
// and 1.73.
constexpr std::uint32_t kManyParcels = 500'000, kManyWithBall = 250'000;
constexpr double kMaxAreaFraction = 0.46;
// Below this area fraction parcels that follow each other in the order of the sort are often too far apart to
// be searched around by one thread. Gps of three kernels, 10^7 on an H200, with one parcel to a thread and
// with two: 0.1 41.7 and 44.3, 0.05 44.5 and 43.1, 0.02 46.8 and 37.8.
constexpr double kThinForTwo = 0.08;

// Sums of a parcel's contacts as in ContactSums, two's complement: one sector of memory. The bits of
// counted_push_x from kCountShift on count the contacts; those below hold the pushes of up to 255 contacts,
// each less than 2^47 counts.
struct alignas(32) DeviceSums {
  unsigned long long velocity_x, velocity_y, counted_push_x, push_y;
};
constexpr unsigned kCountShift = 56;

constexpr unsigned kPairList = 128;

// Touching pairs and the sums of their contacts, between two sorts or in a step that sorts.
struct ContactScratch {
  static constexpr unsigned kNumParts = 4;
  DeviceSums* part[kNumParts] = {};  // of the sums, which they hold in turn
  // In a step that sorts most of that memory is where the parcels go. Then `few` alone holds sums, for each
  // kPairList parcels those of the first kFewSums that touch another one. What more of them need is found by
  // a search for each, as in step_kernel.
  static constexpr unsigned kFewSums = 32;
  DeviceSums* few = nullptr;
  // A bit for each parcel: it touches another one; it touches two or more, ghosts not counted. All zero
  // between steps.
  std::uint32_t* touched = nullptr;
  std::uint32_t* touched_again = nullptr;
  // A list for each kPairList parcels, of the pairs that they find; it has room for as many pairs as they
  // are. num_pairs: found by these parcels, all zero between steps.
  std::uint32_t* first = nullptr;
  std::uint32_t* second = nullptr;
  std::uint32_t* num_pairs = nullptr;
  // What lists too short have no room for, at borders not used. num_pooled: found, zero between steps. If
  // they are more than max_pooled, neither they nor those lists are used.
  std::uint32_t* pooled_first = nullptr;
  std::uint32_t* pooled_second = nullptr;
  std::uint32_t* num_pooled = nullptr;
  std::uint32_t max_pooled = 0;
};

// A sort in a step.
struct StepSort {
  bool is_due = false;
  GridShape grid;                   // by whose cells parcels are sorted
  std::uint32_t* places = nullptr;  // of begin_places(), summed when parcels are counted
};

// Kernels that do a whole step.
enum class OneKernel : std::uint8_t {
  plain,        // step_kernel
  of_block,     // step_of_block_kernel
  two_of_block  // the same, with two parcels to a thread; with a ball one
};

struct StepLaunch {
  StepConstants constants;
  DeviceSearch space;
  ParcelPointers from;  // the parcels; moved in place by launch_move, except in a step that sorts
  // Their destination in a step that sorts, and in launch_step and launch_push_out, which otherwise write no
  // ids. Must not overlap `from`.
  ParcelPointers to;
  ContactScratch contacts;  // of steps in parts
  StepSort sort;
  DisplacedSinceSort displaced;
  StepState* state = nullptr;
  TallySlot* slots = nullptr;  // kNumSlots for each of kMaxOpenSteps steps; a domain has those of one
  std::uint32_t num_open = 0;  // steps since launch_end_steps, before this one
  DrawBuffers draw;            // device memory; null pointers: nothing is drawn
  Method method = Method::impulse;
  OneKernel one_kernel = OneKernel::plain;  // of launch_step; a search of all pairs takes the plain one
  std::uint32_t num = 0;                    // parcels, ghosts included
  // Parcels that are here along x, low <= x <= high, neither have kGhostBit nor touch one that has.
  std::int32_t low_without_ghosts = INT32_MIN, high_without_ghosts = INT32_MAX;
  bool by_two = false;  // set by launch_contacts for its kernels: a thread looks around two parcels
  const std::uint32_t* near = nullptr;  // of launch_border_contacts: the own parcels that may touch ghosts
  std::uint32_t num_near = 0;
};

// Returns whether launch_contacts has to move the ball past the step before, which is open.
PF_HD inline bool contacts_move_ball(const StepLaunch& launch) {
  return launch.num_open > 0 && launch.constants.physics.ball.exists;
}

// Counts the parcels by cell for a sort in launch_step.
void launch_count(const StepLaunch& launch, cudaStream_t stream);

// One step of the parcels. With a ball launch_end_steps follows each, without one at the latest after
// kMaxOpenSteps.
void launch_step(const StepLaunch& launch, cudaStream_t stream);
void launch_step_of_block(const StepLaunch& launch, cudaStream_t stream);  // by launch_step
// The one that is fastest for so many parcels.
OneKernel choose_one_kernel(const Physics& physics, Method method, std::uint32_t num_parcels);

// The same in parts: contacts of own parcels, contacts of own parcels with ghosts, and the move of own
// parcels. There are no ghosts in a step that sorts. launch_contacts moves the ball past the step before if
// that is open. It does nothing where parcels have no contacts at all; with a ball no step may be open then.
void launch_contacts(const StepLaunch& launch, cudaStream_t stream);
void launch_border_contacts(const StepLaunch& launch, cudaStream_t stream);
void launch_find_pairs(const StepLaunch& launch, bool at_borders, cudaStream_t stream);  // by these two
// Returns whether a thread looks around two of so many parcels, since that is faster.
bool searches_by_two(const Physics& physics, std::uint32_t num_parcels);
void launch_move(const StepLaunch& launch, cudaStream_t stream);
void launch_move_and_sort(const StepLaunch& launch, cudaStream_t stream);  // by launch_move

// Moves overlapping parcels apart, and nothing else; dt_s = 0.
void launch_push_out(const StepLaunch& launch, cudaStream_t stream);

// Zeroes the request's totals, and plans roundings and the ball's motion for a first step of constants.dt_s.
void launch_begin_request(const StepConstants& constants, StepState* state, TallySlot* slots,
                          cudaStream_t stream);

// Ends the open steps: adds their slots to the totals and clears them, moves the ball past the last one, and
// plans its next motion.
void launch_end_steps(const StepLaunch& launch, cudaStream_t stream);

}  // namespace pf
