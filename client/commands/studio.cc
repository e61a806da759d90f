// `color3d studio`: colours photos in the browser.
#include "client/studio/studio.h"

#include <cstdlib>
#include <memory>
#include <optional>

#include "client/commands/colored_scene.h"
#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/open_browser.h"
#include "client/lib/local_server.h"
#include "client/studio/address_file.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using Steady = std::chrono::steady_clock;

// Browsers in a sandbox of their package read nothing but visible files of the home folder.
constexpr std::chrono::seconds kSandboxedAfter{15};
constexpr std::chrono::minutes kIdleFromMenu{15};

struct StudioFlags {
  std::string target;  // photos, a film, a folder of results, or jobs/ID; empty: none
  bool open = true;
  bool from_menu = false;
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

fs::path StudioFolder() {
  const fs::path data = UserDataFolder();
  if (data.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "there is no home folder for dropped files; set XDG_DATA_HOME");
  }
  return data / "studio";
}

// Hands the address to the user's browser, in a file that is removed once it is in.
class BrowserDoor {
 public:
  explicit BrowserDoor(std::string address) : address_(std::move(address)) {}

  // Returns false if there is no desktop.
  bool Open() {
    file_.emplace(PrivateFolder(StudioFolder()), address_);
    if (OpenInBrowser(file_->path().string())) return true;
    file_.reset();
    return false;
  }
  void Look(bool entered) {
    if (!file_) return;
    if (entered) return file_.reset();
    const char* home = std::getenv("HOME");
    if (is_second_ || home == nullptr || Steady::now() - since_ < kSandboxedAfter) return;
    is_second_ = true;
    try {
      file_.emplace(home, address_);
      OpenInBrowser(file_->path().string());
    } catch (const Error&) {  // the address is printed as well
    }
  }

 private:
  const std::string address_;
  const Steady::time_point since_ = Steady::now();
  bool is_second_ = false;
  std::optional<AddressFile> file_;
};

ExitCode RunStudio(const Context& context, const StudioFlags& flags) {
  StudioOptions options;
  options.server = context.server;
  options.folder = StudioFolder();
  options.port = flags.port;
  if (flags.from_menu) options.idle_exit = kIdleFromMenu;
  Studio studio(options, *context.interrupt);
  const std::string address = studio.Address(PageOf(context, flags.target, studio));
  { const Connection reachable(context.server, *context.interrupt); }  // starts one if needed
  BrowserDoor door(address);
  const bool opened = flags.open && door.Open();
  if (context.json) {
    PrintJson({{"address", address}, {"opened", opened}});
  } else {
    PrintText(address + "\n");
    PrintNote(context,
              std::string(opened ? "" : "open this address in a browser of this machine; ") +
                  "Ctrl-C ends the studio, and jobs go on");
  }
  studio.Serve([&](bool entered) { door.Look(entered); });
  return ExitCode::kOk;
}

// Who started it from a menu sees no terminal: the browser shows what is wrong.
ExitCode RunStudioFromMenu(const Context& context, const StudioFlags& flags) {
  try {
    return RunStudio(context, flags);
  } catch (const std::exception& e) {
    OpenInBrowser(WriteMessagePage(PrivateFolder(StudioFolder()), e.what()).string());
    throw;
  }
}

}  // namespace

void AddStudioCommand(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<StudioFlags>();
  CLI::App* studio =
      AddCommand(app, context, "studio", "Colour photos or film in the browser", [&context, flags] {
        return flags->from_menu ? RunStudioFromMenu(context, *flags) : RunStudio(context, *flags);
      });
  studio->add_option("TARGET",
                     flags->target,
                     "Folder of photos, a film or a splat; or results to look at: their folder, "
                     "jobs/ID or scenes/ID");
  studio->add_flag("!--no-open", flags->open, "Only print the address");
  studio->add_flag("--from-menu",
                   flags->from_menu,
                   "Without a terminal: the browser shows errors, and the studio ends when its "
                   "pages have been closed for 15 minutes");
  studio->add_option("--port", flags->port, "Port on this machine; 0: any free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
}

}  // namespace color3d::client
