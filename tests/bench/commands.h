// Subcommands of color3d-bench. Each adds itself to the parser; JSON goes to --json or stdout.
#pragma once

#include <CLI/CLI.hpp>

namespace color3d {

void AddPipelineCommand(CLI::App& app);
void AddRasterizeCommand(CLI::App& app);
void AddReconstructCommand(CLI::App& app);
void AddColorizerCommand(CLI::App& app);

}  // namespace color3d
