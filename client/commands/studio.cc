// `color3d studio`: colours photos in the browser.
#include "client/studio/studio.h"

#include <memory>

#include "client/commands/colored_scene.h"
#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/open_browser.h"
#include "client/lib/local_server.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

struct StudioFlags {
  std::string target;  // photos, a film, a folder of results, or jobs/ID; empty: none
  bool open = true;
  int port = 0;
};

bool IsFolderOfResults(const std::string& target) {
  return IsFile(fs::path(target) / artifact::kModel);
}

// Returns the name of the page that shows the target.
std::string PageOf(const Context& context, const std::string& target, Studio& studio) {
  if (target.empty()) return "";
  if (!IsOnServer(target) && !IsFolderOfResults(target)) return studio.OfferPhotos(target);
  Connection connection(context.server, *context.interrupt);
  return Studio::PageOfJob(FindColoredScene(connection, target).name());
}

ExitCode RunStudio(const Context& context, const StudioFlags& flags) {
  StudioOptions options;
  options.server = context.server;
  const fs::path data = UserDataFolder();
  if (data.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "there is no home folder for dropped files; set XDG_DATA_HOME");
  }
  options.folder = data / "studio";
  options.port = flags.port;
  Studio studio(options, *context.interrupt);
  const std::string address = studio.Address(PageOf(context, flags.target, studio));
  { const Connection reachable(context.server, *context.interrupt); }  // starts one if needed
  const bool opened = flags.open && OpenInBrowser(address);
  if (context.json) {
    PrintJson({{"address", address}, {"opened", opened}});
  } else {
    PrintText(address + "\n");
    PrintNote(context,
              std::string(opened ? "" : "open this address in a browser of this machine; ") +
                  "Ctrl-C ends the studio, and jobs go on");
  }
  studio.Serve();
  return ExitCode::kOk;
}

}  // namespace

void AddStudioCommand(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<StudioFlags>();
  CLI::App* studio =
      AddCommand(app, context, "studio", "Colour photos or film in the browser", [&context, flags] {
        return RunStudio(context, *flags);
      });
  studio->add_option("TARGET",
                     flags->target,
                     "Folder of photos, a film or a splat; or results to look at: their folder, "
                     "jobs/ID or scenes/ID");
  studio->add_flag("!--no-open", flags->open, "Only print the address");
  studio->add_option("--port", flags->port, "Port on this machine; 0: any free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
}

}  // namespace color3d::client
