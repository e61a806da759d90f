// color3d: the command line of the Color3D service. Exit codes: client/lib/exit_code.h.
#include <signal.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/lib/command_trace.h"
#include "client/lib/local_server.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {

// Global, because signal handlers can access nothing else.
CancellationToken interrupt;

void OnInterrupt(int) { interrupt.Cancel(); }

void HandleInterrupt() {
  struct sigaction action {};
  action.sa_handler = OnInterrupt;
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // the second Ctrl-C ends the program
  ::sigaction(SIGINT, &action, nullptr);
}

// Returns the error for a mistyped command, which CLI11 reports as a missing one; empty if the
// first word is a command or an option.
std::string UnknownCommand(const CLI::App& app, const Context& context) {
  if (context.arguments.empty() || context.arguments[0].starts_with('-')) return "";
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == context.arguments[0]) return "";
  }
  return "unknown command '" + context.arguments[0] + "'";
}

// Reads the token from a file or the environment, since other users can read command lines.
std::string TokenFrom(const std::filesystem::path& file) {
  const char* given = std::getenv("COLOR3D_TOKEN");
  std::string token = !file.empty() ? ReadFile(file) : given != nullptr ? given : "";
  const size_t end = token.find_last_not_of(" \t\r\n");
  token.resize(end == std::string::npos ? 0 : end + 1);
  if (token.find_first_of(" \t\r\n") != std::string::npos) {
    throw InvalidArgument("{} holds more than one token", file.string());
  }
  return token;
}

// "color3d job show", without arguments.
std::string NameOfCommand(const CLI::App& app) {
  std::string name = app.get_name();
  for (const CLI::App* command : app.get_subcommands()) name += " " + NameOfCommand(*command);
  return name;
}

// Finds a server of this machine when a command connects, and starts one if it may.
std::function<std::string()> OwnServer(const Context& context, bool may_start) {
  return [&context, may_start]() -> std::string {
    LocalServerOptions options;
    options.program = ServerProgram();
    options.data_folder = UserDataFolder();
    const std::string running = FindServer(options.data_folder);
    if (!running.empty()) return running;
    if (!may_start) return kDefaultServer;
    const auto say = [&context](const std::string& line) { PrintNote(context, line); };
    return FindOrStartServer(options, say, *context.interrupt);
  };
}

// Runs the requested command; its errors are reported.
ExitCode RunCommand(const std::filesystem::path& token_file, Context* context) {
  try {
    context->server.token = TokenFrom(token_file);
    context->server.on_wait = [context](const std::string& line) { PrintNote(*context, line); };
    return context->action();
  } catch (const std::exception& e) {
    return ReportException(*context, e);
  }
}

int Main(int argc, char** argv) {
  // Our own messages replace gRPC's log.
  ::setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  // Without a call under way, gRPC polls its sockets every 5 s by default: too rarely for the steps
  // of a TLS handshake between two tries of a call, and servers close slow ones.
  ::setenv("GRPC_CLIENT_CHANNEL_BACKUP_POLL_INTERVAL_MS", "100", /*overwrite=*/0);
  Context context;
  context.interrupt = &interrupt;
  context.arguments.assign(argv + 1, argv + argc);
  CLI::App app("Turns monochrome photos of a scene into a coloured 3D scene.", "color3d");
  app.set_version_flag("--version", COLOR3D_VERSION);
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "Show the help of all commands");
  app.footer(
      "Exit codes: 0 done, 1 the job failed or was cancelled, 2 wrong usage or input, 3 no server, "
      "4 no room, 130 detached.");
  const CLI::Option* server =
      app.add_option("--server",
                     context.server.address,
                     "Address of the server: HOST:PORT, unix:PATH, or https://HOST:PORT for TLS. "
                     "Default: a server of your own, started when it is needed; else " +
                         std::string(kDefaultServer))
          ->envname("COLOR3D_SERVER");
  app.add_option("--ca", context.server.ca, "PEM file of the certificate authority of the server")
      ->envname("COLOR3D_CA");
  app.add_option("--client-cert", context.server.certificate, "PEM file of the client certificate")
      ->envname("COLOR3D_CLIENT_CERT");
  app.add_option(
         "--client-key", context.server.key, "PEM file of the key of the client certificate")
      ->envname("COLOR3D_CLIENT_KEY");
  std::filesystem::path token_file;
  app.add_option("--token-file", token_file, "File with the token; or set COLOR3D_TOKEN")
      ->envname("COLOR3D_TOKEN_FILE");
  app.add_flag("--json", context.json, "Print one JSON object instead of text");
#if defined(COLOR3D_STUDIO)
  AddStudioCommand(app, context);
#endif
  AddColorizeCommand(app, context);
  AddPlanCommand(app, context);
  AddInspectCommand(app, context);
  AddSceneCommands(app, context);
  AddKeyCommands(app, context);
  AddPreviewCommand(app, context);
  AddViewCommand(app, context);
  AddCorrectCommand(app, context);
  AddMovieCommands(app, context);
  AddExportCommand(app, context);
  AddColorizerCommands(app, context);
  AddJobCommands(app, context);
  AddArtifactCommands(app, context);
  AddServerCommands(app, context);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help
    const std::string unknown = UnknownCommand(app, context);
    std::cerr << "color3d: " << (unknown.empty() ? e.what() : unknown) << "; see `color3d --help`"
              << std::endl;
    return static_cast<int>(ExitCode::kBadInput);
  }
  HandleInterrupt();
  if (server->count() == 0 && !context.server.UsesTls()) {
    context.server.own_server = OwnServer(context, !app.got_subcommand("server"));
  }
  CommandTrace trace(COLOR3D_VERSION,
                     [&context](const std::string& line) { PrintNote(context, line); });
  context.server.traceparent = trace.traceparent();
  const int code = static_cast<int>(RunCommand(token_file, &context));
  trace.End(NameOfCommand(app), code);
  return code;
}

}  // namespace
}  // namespace color3d::client

int main(int argc, char** argv) { return color3d::client::Main(argc, argv); }
