// The CUDA backend's state as a file keeps it, and going on from it. The host orders parcels by id.
#include "cuda/cuda_backend.cuh"

namespace pf {
namespace {

template <class T>
void upload(const std::vector<T>& values, DeviceBuffer<T>& to, cudaStream_t stream) {
  PF_CUDA(
      cudaMemcpyAsync(to.data(), values.data(), values.size() * sizeof(T), cudaMemcpyHostToDevice, stream));
  PF_CUDA(cudaStreamSynchronize(stream));
}

// sorted[i] belongs to the parcel id[i].
template <class T>
void order_by_id(const std::vector<T>& sorted, const std::vector<std::uint32_t>& id, std::vector<T>& by_id) {
  by_id.resize(sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) by_id[id[i]] = sorted[i];
}

}  // namespace

void CudaBackend::save(BackendState& state) {
  take_snapshot(state.parcels);
  state.ball = read_state().ball;
  state.ball_was_set = ball_was_set_;
  state.exact_s = exact_.time_s();
  state.exact = {};
  state.exact.active = exact_.active();
  if (exact_.active()) save_exact(state.exact);
}

void CudaBackend::save_exact(ExactSnapshot& exact) {
  const ExactProgress& progress = read_exact_state().progress;
  exact.now = progress.now;
  exact.tick_exponent = progress.tick_exponent;
  exact.ball = progress.ball_trajectory;
  exact.ball_holds = progress.ball_trajectory_holds && !ball_was_set_;
  const std::vector<std::uint32_t> id = download(current_.id, num_parcels_, stream_);
  order_by_id(download(current_.position, num_parcels_, stream_), id, exact.anchor);
  order_by_id(download(current_.tick, num_parcels_, stream_), id, exact.tick);
  if (current_.last_contact_tick.capacity() == 0) return;
  order_by_id(download(current_.last_contact_tick, num_parcels_, stream_), id, exact.last_contact_tick);
}

void CudaBackend::resume(const Physics& physics, const BackendState& state) {
  exact_.reset_time();
  physics_ = physics;
  restore(state.parcels);
  StepState on_device;
  on_device.ball = state.ball;
  on_device.step = state.parcels.step;
  write_state(on_device);
  exact_.set_time(state.exact_s);
  if (state.exact.active) resume_exact(state);
  ball_was_set_ = state.ball_was_set;
}

// enter() anchors every parcel at its position, which fills the positions of now. Then come the saved
// anchors.
void CudaBackend::resume_exact(const BackendState& state) {
  const ExactSnapshot& exact = state.exact;
  const bool has_contact_ticks = !exact.last_contact_tick.empty();
  make_room_for_exact(has_contact_ticks);
  StepRequest request;
  request.method = Method::exact;
  exact_.enter(exact_launch(request), stream_);
  exact_.set_now(exact.now);
  upload(exact.anchor, current_.position, stream_);
  upload(exact.tick, current_.tick, stream_);
  if (has_contact_ticks) upload(exact.last_contact_tick, current_.last_contact_tick, stream_);
  read_exact_state();
  ExactProgress& progress = host_exact_->progress;
  progress.now = exact.now;
  progress.tick_exponent = exact.tick_exponent;
  progress.ball = state.ball;
  progress.ball_trajectory = exact.ball;
  progress.ball_trajectory_holds = exact.ball_holds;
  PF_CUDA(cudaMemcpyAsync(exact_memory_.state(), host_exact_.get(), sizeof(cuda::ExactState),
                          cudaMemcpyHostToDevice, stream_));
  PF_CUDA(cudaStreamSynchronize(stream_));
  expected_displacement_ = 0;
  sorted_ = false;
}

}  // namespace pf
