// color3d-bench dynamic-scenes: writes a made-up scene that moves, for trying out the service.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "tests/bench/commands.h"
#include "tests/support/scenes/dynamic_scene.h"

namespace color3d {
namespace {

struct DynamicScenesArguments {
  std::string out;
  std::string name = "sliding";
  int side = 128;
  DynamicSceneOptions options;
};

void RunDynamicScenes(DynamicScenesArguments args) {
  args.options.which = DynamicCaseFromName(args.name);
  args.options.width = args.side;
  args.options.height = args.side * 3 / 4;
  const DynamicScene scene(args.options);
  WriteDynamicScene(args.out, scene);
  std::printf("%s: %s, %d cameras, %d times, %d x %d px\n",
              args.out.c_str(),
              args.name.c_str(),
              scene.cameras(),
              scene.times(),
              args.options.width,
              args.options.height);
}

}  // namespace

void AddDynamicScenesCommand(CLI::App& app) {
  auto args = std::make_shared<DynamicScenesArguments>();
  CLI::App* command = app.add_subcommand(
      "dynamic-scenes", "write a made-up scene that moves: colour pictures and transforms.json");
  std::vector<std::string> names;
  for (const DynamicCase each : DynamicCases()) names.push_back(DynamicCaseName(each));
  command->add_option("--out", args->out, "folder")->required();
  command->add_option("--case", args->name)->check(CLI::IsMember(names))->capture_default_str();
  command->add_option("--side", args->side, "width, px; the height is 3/4 of it")
      ->check(CLI::Range(22, 512))
      ->capture_default_str();
  command->add_option("--cameras", args->options.cameras)->capture_default_str();
  command->add_option("--times", args->options.times, "time steps; 0: the case's own");
  command->add_flag("--moving-cameras", args->options.moving_cameras);
  command->add_option("--seed", args->options.seed)->capture_default_str();
  command->callback([args] { RunDynamicScenes(*args); });
}

}  // namespace color3d
