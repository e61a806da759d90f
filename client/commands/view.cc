// `color3d view`: shows a coloured scene in the browser.
#include <fmt/core.h>

#include <filesystem>
#include <memory>

#include "client/commands/colored_scene.h"
#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/open_browser.h"
#include "client/commands/results.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/text.h"
#include "core/base/file_kind.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

struct ViewOptions {
  std::string target;  // folder of results, jobs/ID or scenes/ID
  std::string out = "view";
  bool open = true;
};

constexpr const char* kPageRemedy =
    "the scene is of an older version, or the worker was built without the viewer; build it where "
    "npm reaches its registry, and run `color3d colorize` again";

fs::path FindPage(const fs::path& target) {
  std::error_code none;
  if (IsFile(target) && target.extension() == ".html") return target;
  if (!IsFolder(target)) {
    throw Error(ErrorCode::kNotFound,
                "there is no folder {}; name the one that `color3d colorize` wrote to (-o), "
                "jobs/ID or scenes/ID",
                target.string());
  }
  const fs::path page = target / artifact::kViewPage;
  if (IsFile(page)) return page;
  if (fs::exists(target / artifact::kReport, none)) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} has results, but no {}: {}",
                target.string(),
                artifact::kViewPage,
                kPageRemedy);
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "{} has no {}: it holds no finished results of `color3d colorize`; when the job is "
              "done, fetch them with `color3d artifact download jobs/ID -o {}`",
              target.string(),
              artifact::kViewPage,
              target.string());
}

fs::path Download(const Context& context, const ViewOptions& options) {
  Connection connection(context.server, *context.interrupt);
  const v1::Job job = options.target.starts_with("scenes/")
                          ? NewestResult(connection, options.target)
                          : GetJob(connection, ResourceName(options.target, "jobs"));
  if (job.kind() != kind::kColorizeScene) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} is a {} job; only {} jobs have a page for the browser",
                job.name(),
                job.kind(),
                kind::kColorizeScene);
  }
  if (job.state() != v1::Job::STATE_SUCCEEDED) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} has no results: it is {}; see `color3d job show {}`",
                job.name(),
                StateName(job.state()),
                job.name());
  }
  for (const v1::Artifact& artifact : job.artifacts()) {
    if (artifact.name() != artifact::kViewPage) continue;
    PrepareOut(options.out);
    ProgressDisplay display(context.json);
    DownloadArtifacts(connection, {artifact}, options.out, display);
    return fs::path(options.out) / artifact::kViewPage;
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "{} has results, but no {}: {}",
              job.name(),
              artifact::kViewPage,
              kPageRemedy);
}

ExitCode RunView(const Context& context, const ViewOptions& options) {
  const fs::path page = fs::absolute(IsOnServer(options.target) ? Download(context, options)
                                                                : FindPage(options.target));
  const bool opened = options.open && OpenInBrowser(page.string());
  if (context.json) {
    PrintJson({{"page", page.string()}, {"opened", opened}});
    return ExitCode::kOk;
  }
  PrintText(page.string() + "\n");
  if (options.open && !opened) {
    PrintNote(context, "no browser can be started here; open the file in a browser");
  }
  return ExitCode::kOk;
}

}  // namespace

void AddViewCommand(CLI::App& app, Context& context) {
  const auto options = std::make_shared<ViewOptions>();
  CLI::App* view =
      AddCommand(app, context, "view", "Show a coloured scene in the browser", [&context, options] {
        return RunView(context, *options);
      });
  view->add_option("RESULTS",
                   options->target,
                   "Folder of results, or jobs/ID or scenes/ID, whose page is downloaded")
      ->required();
  view->add_option("-o,--out", options->out, "Folder for the downloaded page")
      ->capture_default_str();
  view->add_flag("!--no-open", options->open, "Only print the path of the page");
}

}  // namespace color3d::client
