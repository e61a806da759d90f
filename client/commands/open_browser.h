// Shows a page in the user's browser.
#pragma once

#include <string>

namespace color3d::client {

// Opens a file or address in the default browser. Returns false if there is no desktop or it fails
// within two seconds.
bool OpenInBrowser(const std::string& page);

}  // namespace color3d::client
