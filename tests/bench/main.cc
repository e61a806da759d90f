// color3d-bench: runs and measures stages of the method library without a server.
#include <cstdio>

#include "core/base/error.h"
#include "tests/bench/commands.h"

int main(int argc, char** argv) {
  CLI::App app("Runs and measures stages of Color3D without a server.");
  app.require_subcommand(1);
  color3d::AddAgeCommand(app);
  color3d::AddAugmentationsCommand(app);
  color3d::AddAutomaticCommand(app);
  color3d::AddChoicesCommand(app);
  color3d::AddExplainCommand(app);
  color3d::AddExemplarCommand(app);
  color3d::AddFilmCommand(app);
  color3d::AddDynamicScenesCommand(app);
  color3d::AddFloorCommand(app);
  color3d::AddFormatsCommand(app);
  color3d::AddGoldenCommand(app);
  color3d::AddMakeWeightsCommand(app);
  color3d::AddNetworksCommand(app);
  color3d::AddCorrectCommand(app);
  color3d::AddKeyChoiceCommand(app);
  color3d::AddNextKeyCommand(app);
  color3d::AddPipelineCommand(app);
  color3d::AddQueueCommand(app);
  color3d::AddRasterizeCommand(app);
  color3d::AddReconstructCommand(app);
  color3d::AddPosesCommand(app);
  color3d::AddPretrainCommand(app);
  color3d::AddScoreCommand(app);
  color3d::AddSimulateCommand(app);
  color3d::AddSplatViewsCommand(app);
  color3d::AddStabilityCommand(app);
  color3d::AddStoreCommand(app);
  color3d::AddSuiteCommand(app);
  color3d::AddColorizerCommand(app);
  color3d::AddKeyViewCommand(app);
  color3d::AddPlotCommand(app);
  color3d::AddChromaCommand(app);
  color3d::AddWeightsCommand(app);
  color3d::AddHintsCommand(app);
  color3d::AddRecolorCommand(app);
  color3d::AddReferenceCommand(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e);
  } catch (const color3d::Error& e) {
    std::fprintf(stderr, "color3d-bench: %s: %s\n", color3d::ErrorCodeName(e.code()), e.what());
    return 1;
  }
  return 0;
}
