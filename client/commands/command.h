// Shared by all commands: global options, the interrupt flag, the action to run.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "client/lib/exit_code.h"

namespace color3d::client {

struct Context {
  ServerTarget server;
  bool json = false;
  // Set by the first Ctrl-C; the second one ends the program at once.
  const CancellationToken* interrupt = nullptr;
  std::vector<std::string> arguments;  // as typed, without the name of the program
  // The requested command; set while the command line is parsed.
  std::function<ExitCode()> action;
};

// Ends the program with this exit code. what() is the message for the user; empty: none.
class CommandFailure : public std::runtime_error {
 public:
  CommandFailure(ExitCode code, const std::string& message)
      : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

// Adds a command that runs `run`. Options of its parents may follow it. Requires: `context`
// outlives the command.
inline CLI::App* AddCommand(CLI::App& parent,
                            Context& context,
                            const std::string& name,
                            const std::string& help,
                            std::function<ExitCode()> run) {
  CLI::App* command = parent.add_subcommand(name, help);
  command->fallthrough();
  command->callback([&context, run] { context.action = run; });
  return command;
}

// Each declares its commands in `app`. Requires: `context` outlives `app`.
void AddColorizeCommand(CLI::App& app, Context& context);
void AddPlanCommand(CLI::App& app, Context& context);
void AddInspectCommand(CLI::App& app, Context& context);
void AddSceneCommands(CLI::App& app, Context& context);
void AddKeyCommands(CLI::App& app, Context& context);
void AddPreviewCommand(CLI::App& app, Context& context);
void AddViewCommand(CLI::App& app, Context& context);
void AddCorrectCommand(CLI::App& app, Context& context);
void AddMovieCommands(CLI::App& app, Context& context);
void AddExportCommand(CLI::App& app, Context& context);
void AddColorizerCommands(CLI::App& app, Context& context);
void AddJobCommands(CLI::App& app, Context& context);
void AddArtifactCommands(CLI::App& app, Context& context);
void AddStudioCommand(CLI::App& app, Context& context);  // unless it was left out of the build
void AddServerCommands(CLI::App& app, Context& context);
void AddQueueCommands(CLI::App& server, Context& context);

}  // namespace color3d::client
