#include "cuda/launch_batches.cuh"

#include <algorithm>

#include "cuda/check.cuh"

namespace pf {
namespace {

// The device waits for the first batch of a request while it is recorded. So that is a short one, and each of
// the others takes up to twice as many calls as the one before.
constexpr unsigned kFirstCalls = 4, kMostCalls = 16;

// Returns whether launches that may start early (cuda/launch.cuh) may do so in a graph, too.
bool graphs_start_early() {
#if CUDART_VERSION >= 12030
  static const bool has = [] {
    int version = 0;
    return cudaDriverGetVersion(&version) == cudaSuccess && version >= 12030;
  }();
  return has;
#else
  return false;
#endif
}

// Takes over what the nodes do, if the graphs have the same shape.
bool update(cudaGraphExec_t executable, cudaGraph_t graph) {
  cudaGraphExecUpdateResultInfo result{};
  if (cudaGraphExecUpdate(executable, graph, &result) == cudaSuccess) return true;
  cudaGetLastError();
  return false;
}

// A recorded graph.
class OwnedGraph {
 public:
  explicit OwnedGraph(cudaGraph_t graph) : graph_(graph) {}
  ~OwnedGraph() { cudaGraphDestroy(graph_); }
  OwnedGraph(const OwnedGraph&) = delete;
  OwnedGraph& operator=(const OwnedGraph&) = delete;

  cudaGraph_t get() const { return graph_; }

 private:
  cudaGraph_t graph_;
};

}  // namespace

LaunchBatches::~LaunchBatches() {
  for (const Graph& graph : graphs_) cudaGraphExecDestroy(graph.executable);
}

LaunchBatches::Scope::Scope(LaunchBatches& batches, cudaStream_t stream) : batches_(batches) {
  batches.stream_ = stream;
  batches.is_enabled_ = graphs_start_early();
  batches.num_calls_ = 0;
  batches.max_calls_ = kFirstCalls;
}

LaunchBatches::Scope::~Scope() {
  batches_.is_enabled_ = false;
  cudaGraph_t dropped{};
  if (!batches_.is_recording_) return;
  if (batches_.end_recording(dropped) == cudaSuccess) cudaGraphDestroy(dropped);
  cudaGetLastError();  // so that the next check does not report what was reported
}

void LaunchBatches::extend(unsigned kind) {
  if (!is_enabled_) return;
  if (num_calls_ == max_calls_) {
    flush();
    max_calls_ = std::min(2 * max_calls_, kMostCalls);
  }
  ++num_calls_;
  if (is_recording_) return;
  // Relaxed: to load a kernel at its first launch is allowed.
  PF_CUDA(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeRelaxed));
  is_recording_ = true;
  kind_ = kind;
}

cudaError_t LaunchBatches::end_recording(cudaGraph_t& recorded) {
  is_recording_ = false;
  num_calls_ = 0;
  return cudaStreamEndCapture(stream_, &recorded);
}

void LaunchBatches::flush() {
  if (!is_recording_) return;
  cudaGraph_t recorded{};
  PF_CUDA(end_recording(recorded));
  const OwnedGraph graph(recorded);
  Shape shape{kind_};
  PF_CUDA(cudaGraphGetNodes(graph.get(), nullptr, &shape.num_nodes));
  if (shape.num_nodes > 0) PF_CUDA(cudaGraphLaunch(executable_for(graph.get(), shape), stream_));
}

cudaGraphExec_t LaunchBatches::executable_for(cudaGraph_t recorded, const Shape& shape) {
  const auto same = std::ranges::find(graphs_, shape, &Graph::shape);
  if (same != graphs_.end()) {
    if (update(same->executable, recorded)) return same->executable;
    cudaGraphExecDestroy(same->executable);
    graphs_.erase(same);
  }
  cudaGraphExec_t executable{};
  PF_CUDA(cudaGraphInstantiateWithFlags(&executable, recorded, 0));
  graphs_.push_back({shape, executable});
  return executable;
}

}  // namespace pf
