// color3d-server: `serve` answers RPCs and supervises workers; `token`, `backup`, `restore`,
// `fsck` and `migrate` are for operators; `worker` executes color3d-worker, the program beside this
// one that links the method library.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <string>

#include "core/base/error.h"
#include "server/access/tokens.h"
#include "server/keeping_commands.h"
#include "server/ops/process.h"
#include "server/serve.h"
#include "server/serve_flags.h"

namespace color3d {
namespace {

// Replaces this process with color3d-worker and the arguments after "worker".
int ExecWorker(char** argv) {
  const std::string program = (ProgramFolder() / "color3d-worker").string();
  argv[1] = const_cast<char*>(program.c_str());
  ::execv(program.c_str(), argv + 1);
  std::cerr << "color3d-server: cannot start " << program << ": " << std::strerror(errno)
            << "; install color3d-worker beside color3d-server\n";
  return 2;
}

int Main(int argc, char** argv) {
  // Inherited by workers. Threads that spin while waiting slow down a busy machine.
  ::setenv("OMP_WAIT_POLICY", "PASSIVE", /*overwrite=*/0);
  if (argc > 1 && std::string(argv[1]) == "worker") return ExecWorker(argv);
  ServeOptions options;
  CLI::App app("Color3D server: colours 3D scenes from monochrome photographs.");
  app.set_version_flag("--version", COLOR3D_VERSION);
  CLI::App* serve = app.add_subcommand("serve", "Answer RPCs and run jobs");
  app.add_subcommand("worker", "Run jobs of a server (see worker --help)");
  std::string token_name, token_role = "submit";
  std::string token_project;
  std::filesystem::path token_file;
  CLI::App* token = app.add_subcommand("token", "Create a token for a caller and print it once");
  token->add_option("NAME", token_name, "Name of the caller, for logs")->required();
  token
      ->add_option(
          "--role",
          token_role,
          "read, submit or admin, each with the ones before; or worker, for color3d-worker "
          "--server")
      ->capture_default_str();
  token->add_option("--project",
                    token_project,
                    "Project; the token gives access to its scenes, jobs and files only");
  token->add_option("--tokens", token_file, "File of serve --tokens")->required();
  KeepingArguments keeping;
  AddKeepingCommands(&app, &keeping);
  app.require_subcommand(1);
  AddServeFlags(serve, &options);
  CLI11_PARSE(app, argc, argv);
  CompleteFromEnvironment(&options);
  // The server's own messages are clearer than the log of gRPC.
  ::setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  try {
    if (keeping.run) return keeping.run();
    if (token->parsed()) {
      std::error_code error;
      const bool is_fresh = !std::filesystem::exists(token_file, error);
      std::cout << AddToken(token_file, token_name, RoleFromName(token_role), token_project)
                << "\n";
      if (is_fresh && ::geteuid() == 0) {
        std::cerr << "color3d-server: note: " << token_file.string()
                  << " is new and root's alone; let the service's user read it (chown)\n";
      }
      return 0;
    }
    Serve(options);
    return 0;
  } catch (const Error& e) {
    std::cerr << "color3d-server: " << e.what() << "\n";
    return e.code() == ErrorCode::kUnavailable ? 1 : 2;  // 1: a retry may succeed
  } catch (const std::exception& e) {
    std::cerr << "color3d-server: unexpected: " << e.what() << "\n";
    return 1;
  }
}

}  // namespace
}  // namespace color3d

int main(int argc, char** argv) { return color3d::Main(argc, argv); }
