// The store's file as a whole.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

// Throws Error{kFailedPrecondition} that names the folder when there is none.
void RequireStore(const std::filesystem::path& file);

// All of it as it is at one moment, compact and without a log beside it; others may write
// meanwhile. `copy` is replaced. Throws Error as opening a store does.
void CopyStore(const std::filesystem::path& file, const std::filesystem::path& copy);

// Jobs of the store, which nobody uses, that would go on from this checkpoint begin anew.
void DropCheckpoint(const std::filesystem::path& file, const std::string& sha256);

// Faults of the file in SQLite's words, at most 20.
std::vector<std::string> StoreProblems(const std::filesystem::path& file);

}  // namespace color3d
