// Options of the stage evaluate.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/splat/chroma/chroma_options.h"

namespace color3d {

struct TruthFile {
  std::string view;
  std::filesystem::path file;
};
struct EvaluateOptions {
  std::vector<TruthFile> truth;           // of held-out views: these are scored. May be empty
  std::vector<TruthFile> training_truth;  // of training views. May be empty
  // Also score what the same geometry reaches under the true colours of all training views
  // ("delta_e00_chroma_bound"): what the reconstruction itself costs. About as long as
  // solve_chroma.
  bool bound = false;
  ChromaOptions chroma;  // of the bound
  void Validate() const;
};

}  // namespace color3d
