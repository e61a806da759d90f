// cpp-httplib, without a macro of the C library's resolver that comes with it and that Eigen's
// headers stumble over. Include this in place of <httplib.h>.
#pragma once

#include <httplib.h>

#undef _res
