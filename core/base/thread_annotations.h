// Annotations for Clang's thread-safety analysis (-Wthread-safety); other compilers ignore them.
// https://clang.llvm.org/docs/ThreadSafetyAnalysis.html
// Mutexes are color3d::Mutex (core/base/mutex.h): those of libstdc++ are not annotated.
#pragma once

#ifdef __clang__
#define COLOR3D_THREAD_ANNOTATION(x) __attribute__((x))
#else
#define COLOR3D_THREAD_ANNOTATION(x)
#endif

// On a member: access requires the mutex.
#define GUARDED_BY(x) COLOR3D_THREAD_ANNOTATION(guarded_by(x))
// On a pointer: access to the object requires the mutex.
#define PT_GUARDED_BY(x) COLOR3D_THREAD_ANNOTATION(pt_guarded_by(x))
// On a function: callers must hold, or must not hold, the mutex.
#define REQUIRES(...) COLOR3D_THREAD_ANNOTATION(requires_capability(__VA_ARGS__))
#define EXCLUDES(...) COLOR3D_THREAD_ANNOTATION(locks_excluded(__VA_ARGS__))
// On a function: locks or unlocks the mutex.
#define ACQUIRE(...) COLOR3D_THREAD_ANNOTATION(acquire_capability(__VA_ARGS__))
#define TRY_ACQUIRE(...) COLOR3D_THREAD_ANNOTATION(try_acquire_capability(__VA_ARGS__))
#define RELEASE(...) COLOR3D_THREAD_ANNOTATION(release_capability(__VA_ARGS__))
// On a class: a mutex, or a lock that lives in a scope.
#define CAPABILITY(x) COLOR3D_THREAD_ANNOTATION(capability(x))
#define SCOPED_CAPABILITY COLOR3D_THREAD_ANNOTATION(scoped_lockable)
// On a function that the analysis cannot follow. Say why beside it.
#define NO_THREAD_SAFETY_ANALYSIS COLOR3D_THREAD_ANNOTATION(no_thread_safety_analysis)
