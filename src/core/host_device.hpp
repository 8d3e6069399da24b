// Marks functions that compile for the host and, under nvcc, for the device too.
#pragma once

#if defined(__CUDACC__)
#define PF_HD __host__ __device__
#else
#define PF_HD
#endif
