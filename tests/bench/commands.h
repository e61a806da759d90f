// Subcommands of color3d-bench. Each function adds its command to the parser.
#pragma once

#include <CLI/CLI.hpp>

namespace color3d {

void AddAgeCommand(CLI::App& app);
void AddAugmentationsCommand(CLI::App& app);
void AddAutomaticCommand(CLI::App& app);
void AddChoicesCommand(CLI::App& app);
void AddExplainCommand(CLI::App& app);
void AddExemplarCommand(CLI::App& app);
void AddFilmCommand(CLI::App& app);
void AddDynamicScenesCommand(CLI::App& app);
void AddFloorCommand(CLI::App& app);
void AddFormatsCommand(CLI::App& app);
void AddGoldenCommand(CLI::App& app);
void AddMakeWeightsCommand(CLI::App& app);
void AddNetworksCommand(CLI::App& app);
void AddHintsCommand(CLI::App& app);
void AddCorrectCommand(CLI::App& app);
void AddKeyChoiceCommand(CLI::App& app);
void AddNextKeyCommand(CLI::App& app);
void AddPipelineCommand(CLI::App& app);
void AddQueueCommand(CLI::App& app);
void AddRasterizeCommand(CLI::App& app);
void AddReconstructCommand(CLI::App& app);
void AddRecolorCommand(CLI::App& app);
void AddReferenceCommand(CLI::App& app);
void AddPosesCommand(CLI::App& app);
void AddPretrainCommand(CLI::App& app);
void AddScoreCommand(CLI::App& app);
void AddSimulateCommand(CLI::App& app);
void AddSplatViewsCommand(CLI::App& app);
void AddStabilityCommand(CLI::App& app);
void AddStoreCommand(CLI::App& app);
void AddSuiteCommand(CLI::App& app);
void AddColorizerCommand(CLI::App& app);
void AddKeyViewCommand(CLI::App& app);
void AddPlotCommand(CLI::App& app);
void AddChromaCommand(CLI::App& app);
void AddWeightsCommand(CLI::App& app);

}  // namespace color3d
