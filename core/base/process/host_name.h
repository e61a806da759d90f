// The name of this machine.
#pragma once

#include <string>

namespace color3d {

// As the system has it, in letters, digits, '.' and '-'; `otherwise` if it has none.
std::string HostName(const std::string& otherwise);

}  // namespace color3d
