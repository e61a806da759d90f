# Part of `cmake --install`: the studio's entry in the menu, with the program's place at that time.
# Desktops look for entries below $XDG_DATA_DIRS: /usr/local/share, /usr/share, and ~/.local/share.
#   source, bin, apps: variables set by the caller; the latter two relative to the prefix
set(program "${CMAKE_INSTALL_PREFIX}/${bin}/color3d")
if(CMAKE_INSTALL_PREFIX MATCHES "_CPack_Packages")
  set(program color3d) # of a package: found in PATH, wherever it is unpacked
endif()
set(entry "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/${apps}/color3d-studio.desktop")
configure_file("${source}/color3d-studio.desktop.in" "${entry}" @ONLY)
message(STATUS "Installing: ${entry}")
