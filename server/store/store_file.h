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

// What is wrong with it in SQLite's words, at most 20 things.
std::vector<std::string> StoreProblems(const std::filesystem::path& file);

}  // namespace color3d
