// Addresses to which the server may send notifications about finished jobs.
#pragma once

#include <string>
#include <vector>

namespace color3d {

// Throws Error{kInvalidArgument} unless it is "http[s]://HOST[:PORT][/PATH]" without a user.
void CheckNotifyTarget(const std::string& allowed);

// Throws Error{kInvalidArgument} for a bad URL, or kFailedPrecondition if none of `allowed` is a
// prefix of it that ends at a path component. Submitters must not choose the hosts that this
// machine connects to.
void CheckNotifyUrl(const std::string& url, const std::vector<std::string>& allowed);

}  // namespace color3d
