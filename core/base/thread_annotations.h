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
#define COLOR3D_GUARDED_BY(x) COLOR3D_THREAD_ANNOTATION(guarded_by(x))
// On a pointer: access to the object requires the mutex.
#define COLOR3D_PT_GUARDED_BY(x) COLOR3D_THREAD_ANNOTATION(pt_guarded_by(x))
// On a function: callers must hold, or must not hold, the mutex.
#define COLOR3D_REQUIRES(...) COLOR3D_THREAD_ANNOTATION(requires_capability(__VA_ARGS__))
#define COLOR3D_EXCLUDES(...) COLOR3D_THREAD_ANNOTATION(locks_excluded(__VA_ARGS__))
// On a function: locks or unlocks the mutex.
#define COLOR3D_ACQUIRE(...) COLOR3D_THREAD_ANNOTATION(acquire_capability(__VA_ARGS__))
#define COLOR3D_TRY_ACQUIRE(...) COLOR3D_THREAD_ANNOTATION(try_acquire_capability(__VA_ARGS__))
#define COLOR3D_RELEASE(...) COLOR3D_THREAD_ANNOTATION(release_capability(__VA_ARGS__))
// On a class: a mutex, or a lock that lives in a scope.
#define COLOR3D_CAPABILITY(x) COLOR3D_THREAD_ANNOTATION(capability(x))
#define COLOR3D_SCOPED_CAPABILITY COLOR3D_THREAD_ANNOTATION(scoped_lockable)
// On a function that the analysis cannot follow. Say why beside it.
#define COLOR3D_NO_THREAD_SAFETY_ANALYSIS COLOR3D_THREAD_ANNOTATION(no_thread_safety_analysis)
