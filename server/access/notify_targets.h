// Where the server may be told to send word that a job has ended.
#pragma once

#include <string>
#include <vector>

namespace color3d {

// Throws Error{kInvalidArgument} unless it is "http[s]://HOST[:PORT][/PATH]" without a user.
void CheckNotifyTarget(const std::string& allowed);

// Throws Error{kInvalidArgument}, or kFailedPrecondition where none of `allowed` is the beginning
// of the address, up to the end of a part of its path: whoever asks for a job must not choose whom
// this machine talks to.
void CheckNotifyUrl(const std::string& url, const std::vector<std::string>& allowed);

}  // namespace color3d
