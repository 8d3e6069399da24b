// Marks functions that compile for the host and, under nvcc, for the device too.
#pragma once

#if defined(__CUDACC__)
#define PF_HD __host__ __device__
#define PF_HD_RARE __host__ __device__ __noinline__
#else
#define PF_HD
#define PF_HD_RARE [[gnu::noinline]]
#endif
