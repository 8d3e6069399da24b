// CUDA graphs for the CPU. cuda_runtime.h includes it once it has cudaError_t and cudaStream_t.
#pragma once

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

// Of what a thread records. Until it is launched nothing of it happens.
enum cudaGraphNodeType { cudaGraphNodeTypeKernel, cudaGraphNodeTypeMemset };
struct cudaGraphNode {
  cudaGraphNodeType type;
  std::function<void()> work;
};
using cudaGraphNode_t = const cudaGraphNode*;
using cudaGraph_t = std::vector<cudaGraphNode>*;
using cudaGraphExec_t = cudaGraph_t;
namespace kernels_on_cpu {
inline thread_local cudaGraph_t recorded = nullptr;
inline void now_or_later(cudaGraphNodeType type, std::function<void()> work) {
  if (recorded == nullptr)
    work();
  else
    recorded->push_back({type, std::move(work)});
}
// Of what cannot be part of a graph.
inline cudaError_t only_now() {
  return recorded == nullptr ? cudaSuccess : cudaErrorStreamCaptureUnsupported;
}
}  // namespace kernels_on_cpu
enum cudaStreamCaptureMode { cudaStreamCaptureModeRelaxed };
inline cudaError_t cudaStreamBeginCapture(cudaStream_t, cudaStreamCaptureMode) {
  if (kernels_on_cpu::recorded != nullptr) return cudaErrorStreamCaptureUnsupported;
  kernels_on_cpu::recorded = new std::vector<cudaGraphNode>;
  return cudaSuccess;
}
inline cudaError_t cudaStreamEndCapture(cudaStream_t, cudaGraph_t* graph) {
  *graph = std::exchange(kernels_on_cpu::recorded, nullptr);
  return cudaSuccess;
}
inline cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  delete graph;
  return cudaSuccess;
}
inline cudaError_t cudaGraphExecDestroy(cudaGraphExec_t graph) { return cudaGraphDestroy(graph); }
inline cudaError_t cudaGraphGetNodes(cudaGraph_t graph, cudaGraphNode_t*, std::size_t* num) {
  *num = graph->size();
  return cudaSuccess;
}
inline cudaError_t cudaGraphInstantiateWithFlags(cudaGraphExec_t* executable, cudaGraph_t graph, unsigned) {
  *executable = new std::vector<cudaGraphNode>(*graph);
  return cudaSuccess;
}
struct cudaGraphExecUpdateResultInfo {};
inline cudaError_t cudaGraphExecUpdate(cudaGraphExec_t executable, cudaGraph_t graph,
                                       cudaGraphExecUpdateResultInfo*) {
  const auto have_same_type = [](const cudaGraphNode& a, const cudaGraphNode& b) { return a.type == b.type; };
  if (!std::ranges::equal(*executable, *graph, have_same_type)) return cudaErrorGraphExecUpdateFailure;
  *executable = *graph;
  return cudaSuccess;
}
inline cudaError_t cudaGraphLaunch(cudaGraphExec_t executable, cudaStream_t) {
  for (const cudaGraphNode& node : *executable) kernels_on_cpu::now_or_later(node.type, node.work);
  return cudaSuccess;
}
