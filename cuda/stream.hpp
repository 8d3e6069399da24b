// The one stream that all of the program's CUDA work goes through, GL's mapping included, so that order on
// the device is order of the calls.
#pragma once

#include <cuda_runtime.h>

namespace pf {

// Made at the first call, on the device that is current then; lives as long as the program.
cudaStream_t work_stream();

}  // namespace pf
