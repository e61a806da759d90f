// Operations on the whole file of the store.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

// Throws Error{kFailedPrecondition} with the folder if the file does not exist.
void RequireStore(const std::filesystem::path& file);

// Writes a compact snapshot without a log file to `copy`, replacing it; other processes may write
// meanwhile. Throws like opening a store.
void CopyStore(const std::filesystem::path& file, const std::filesystem::path& copy);

// Removes this checkpoint from all jobs, which then start over. Requires: no process uses the
// store.
void DropCheckpoint(const std::filesystem::path& file, const std::string& sha256);

// Returns at most 20 faults of the file, as reported by SQLite.
std::vector<std::string> StoreProblems(const std::filesystem::path& file);

}  // namespace color3d
