/// @file
/// The namespace of the kernel, one for each instruction set. Every header begins with this one. It asks for C++20 and
/// refuses -ffast-math.
/// ```
/// namespace nscdd { inline namespace NSCDD_ABI {   // users write nscdd:: and see nothing of it
/// ```
/// The linker keeps one copy of each inline function and template. Two units of a program, compiled with different
/// -march, must not share that copy. Else the lesser processor would run instructions that it lacks, or read batches of
/// another width. So the name of the namespace says for which processor the unit is compiled.
#pragma once

#if __cplusplus < 202002L
#error "nscdd: compile as C++20 or later (-std=c++20)"
#include "stop after the error above"  // no such file: the compiler says no more
#endif

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "nscdd: compile without -ffast-math (-Ofast, -ffinite-math-only): the kernel's checks for NaN would vanish"
#endif

// GCC 12 takes the operands that its AVX-512 headers leave undefined on purpose for uninitialised. What counts is where
// these headers are first read: a program that reads them, or Eigen, before us gets the warnings that Eigen gives it
// anyway.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <Eigen/Core>
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

// The name, where the macro is 1; else nothing.
#define NSCDD_ABI_IF(macro, name) NSCDD_ABI_IF_VALUE(macro, name)
#define NSCDD_ABI_IF_VALUE(value, name) NSCDD_ABI_SECOND(NSCDD_ABI_IF_##value name, , )
#define NSCDD_ABI_IF_1 ,
#define NSCDD_ABI_SECOND(...) NSCDD_ABI_SECOND_OF(__VA_ARGS__)
#define NSCDD_ABI_SECOND_OF(first, second, ...) second

#define NSCDD_ABI_JOIN(...) NSCDD_ABI_PASTE(__VA_ARGS__)
#define NSCDD_ABI_PASTE(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p) a##b##c##d##e##f##g##h##i##j##k##l##m##n##o##p

// The widest vectors that the compiler may use, each including those below it.
#if defined(__AVX512F__)
#define NSCDD_ABI_VECTORS avx512
#elif defined(__AVX2__)
#define NSCDD_ABI_VECTORS avx2
#elif defined(__AVX__)
#define NSCDD_ABI_VECTORS avx
#elif defined(__SSE4_2__)
#define NSCDD_ABI_VECTORS sse42
#elif defined(__SSE4_1__)
#define NSCDD_ABI_VECTORS sse41
#elif defined(__SSSE3__)
#define NSCDD_ABI_VECTORS ssse3
#elif defined(__SSE3__)
#define NSCDD_ABI_VECTORS sse3
#elif defined(__SSE2__)
#define NSCDD_ABI_VECTORS sse2
#elif defined(__ARM_FEATURE_SVE)
#define NSCDD_ABI_VECTORS sve
#elif defined(__ARM_NEON)
#define NSCDD_ABI_VECTORS neon
#else
#define NSCDD_ABI_VECTORS other
#endif

#if !defined(NSCDD_LANES)
#if defined(__AVX512F__)
// How many doubles a packet holds (packet.hpp): 8, 4 or 2. Fewer than the machine could are for tests.
#define NSCDD_LANES 8
#elif defined(__AVX__)
#define NSCDD_LANES 4
#else
#define NSCDD_LANES 2
#endif
#endif

// u: Eigen is told to use no vectors (EIGEN_DONT_VECTORIZE).
#if defined(EIGEN_VECTORIZE)
#define NSCDD_ABI_EIGEN _
#else
#define NSCDD_ABI_EIGEN u_
#endif

// Other instruction sets that compilers use on their own.
#define NSCDD_ABI_SCALAR                                                                                \
    NSCDD_ABI_JOIN(s, NSCDD_ABI_IF(__FMA__, f), NSCDD_ABI_IF(__FMA4__, g), NSCDD_ABI_IF(__XOP__, x),    \
                   NSCDD_ABI_IF(__BMI__, b), NSCDD_ABI_IF(__BMI2__, c), NSCDD_ABI_IF(__TBM__, t),       \
                   NSCDD_ABI_IF(__LZCNT__, l), NSCDD_ABI_IF(__POPCNT__, p), NSCDD_ABI_IF(__MOVBE__, m), \
                   NSCDD_ABI_IF(__F16C__, h), , , , , )
#define NSCDD_ABI_AVX512                                                                                               \
    NSCDD_ABI_JOIN(_v, NSCDD_ABI_IF(__AVX512DQ__, d), NSCDD_ABI_IF(__AVX512BW__, b), NSCDD_ABI_IF(__AVX512VL__, l),    \
                   NSCDD_ABI_IF(__AVX512CD__, c), NSCDD_ABI_IF(__AVX512ER__, e), NSCDD_ABI_IF(__AVX512PF__, p),        \
                   NSCDD_ABI_IF(__AVX512IFMA__, i), NSCDD_ABI_IF(__AVX512VBMI__, v), NSCDD_ABI_IF(__AVX512VBMI2__, w), \
                   NSCDD_ABI_IF(__AVX512VNNI__, n), NSCDD_ABI_IF(__AVX512BITALG__, a),                                 \
                   NSCDD_ABI_IF(__AVX512VPOPCNTDQ__, q), NSCDD_ABI_IF(__AVX512FP16__, h),                              \
                   NSCDD_ABI_IF(__AVX512BF16__, g), NSCDD_ABI_IF(__AVXVNNI__, y))

// Such as avx2_4_sfbclpmh_v for -march=x86-64-v3. Given by who links libraries that the loader picks
// (kernel/src/levels.cmake).
#if !defined(NSCDD_ABI)
#define NSCDD_ABI                                                                                                      \
    NSCDD_ABI_JOIN(NSCDD_ABI_VECTORS, _, NSCDD_LANES, NSCDD_ABI_EIGEN, NSCDD_ABI_SCALAR, NSCDD_ABI_AVX512, , , , , , , \
                   , , , )
#endif
