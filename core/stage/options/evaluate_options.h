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
  std::vector<TruthFile> truth;           // of held-out views, which are scored; may be empty
  std::vector<TruthFile> training_truth;  // of training views; may be empty
  // Also scores the same geometry with the true colours of all training views
  // ("delta_e00_chroma_bound"): the error of the reconstruction itself. Takes about as long as
  // solve_chroma.
  bool bound = false;
  ChromaOptions chroma;  // for the bound
  void Validate() const;
};

}  // namespace color3d
