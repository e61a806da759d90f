#include "client/studio/fetched_files.h"

#include "client/lib/out_folder.h"
#include "core/base/error.h"

namespace color3d::client {
namespace fs = std::filesystem;

FetchedFiles::Result FetchedFiles::Of(const std::string& job, const std::string& name) {
  if (!IsSafeRelativePath(name)) throw InvalidArgument("the name of the file is not possible");
  const fs::path file = SafePathBelow(scratch_.path() / job, name);
  const std::shared_ptr<Entry> entry = [&] {
    const MutexLock lock(mutex_);
    std::shared_ptr<Entry>& known = entries_[{job, name}];
    if (!known) known = std::make_shared<Entry>();
    return known;
  }();
  const MutexLock lock(entry->mutex);
  if (!entry->media_type) entry->media_type = calls_.Fetch(job, name, file);
  return {file, *entry->media_type};
}

}  // namespace color3d::client
