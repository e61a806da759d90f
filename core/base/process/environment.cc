#include "core/base/process/environment.h"

extern char** environ;

namespace color3d {

bool IsInherited(std::string_view variable) {
  // With "=": the whole name; without: a prefix of names.
  for (const std::string_view name : {"PATH=",
                                      "LANG=",
                                      "LC_",
                                      "TZ=",
                                      "HOME=",
                                      "TMPDIR=",  // locations
                                      "LD_LIBRARY_PATH=",
                                      "LD_PRELOAD=",
                                      "GLIBC_TUNABLES=",
                                      "MALLOC_",
                                      "FAKETIME",
                                      "OMP_",
                                      "OPENBLAS_",
                                      "COLOR3D_ISA=",
                                      "COLOR3D_TEST_",  // how it is computed
                                      "SSL_CERT_FILE=",
                                      "SSL_CERT_DIR=",
                                      "GRPC_DEFAULT_SSL_ROOTS_FILE_PATH=",
                                      "GRPC_VERBOSITY=",
                                      "GRPC_TRACE=",
                                      "OTEL_EXPORTER_OTLP_ENDPOINT=",  // but no headers
                                      "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT=",
                                      "OTEL_EXPORTER_OTLP_CERTIFICATE=",
                                      "OTEL_EXPORTER_OTLP_TIMEOUT=",
                                      "OTEL_RESOURCE_ATTRIBUTES=",
                                      "OTEL_SDK_DISABLED=",
                                      "OTEL_TRACES_EXPORTER=",
                                      "ASAN_OPTIONS=",
                                      "LSAN_OPTIONS=",
                                      "TSAN_OPTIONS=",
                                      "UBSAN_OPTIONS="}) {
    if (variable.starts_with(name)) return true;
  }
  return false;
}

std::vector<std::string> InheritedEnvironment() {
  std::vector<std::string> variables;
  for (char** e = environ; *e != nullptr; ++e) {
    if (IsInherited(*e)) variables.emplace_back(*e);
  }
  return variables;
}

}  // namespace color3d
