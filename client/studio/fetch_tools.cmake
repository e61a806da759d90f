# Tools for the page, fetched from npm when the build is configured: exactly these versions, checked by their
# digests. esbuild bundles the page; typescript checks its types in a test.
set(COLOR3D_PAGE_TOOLS "" CACHE PATH "Folder with npm's packages of the page's tools (.tgz), for building without a network")

# Unpacks npm's PACKAGE@VERSION below FOLDER. Sets `problem_variable` to the reason if it cannot be had, else to "".
function(color3d_fetch_tool folder package version sha512 problem_variable)
  string(REGEX REPLACE "^@" "" name ${package})
  string(REPLACE "/" "-" name ${name})
  set(tarball ${folder}/${name}-${version}.tgz)
  set(${problem_variable} "" PARENT_SCOPE)
  if(EXISTS ${folder}/${name}/package/package.json AND EXISTS ${tarball})
    file(SHA512 ${tarball} found)
    if(found STREQUAL sha512)
      return()
    endif()
  endif()
  file(MAKE_DIRECTORY ${folder})
  if(COLOR3D_PAGE_TOOLS)
    file(COPY_FILE ${COLOR3D_PAGE_TOOLS}/${name}-${version}.tgz ${tarball} RESULT copied)
    if(NOT copied STREQUAL "0")
      set(${problem_variable} "${COLOR3D_PAGE_TOOLS}/${name}-${version}.tgz: ${copied}" PARENT_SCOPE)
      return()
    endif()
  elseif(NOT EXISTS ${tarball})
    find_program(NPM_PROGRAM npm)
    if(NOT NPM_PROGRAM)
      set(${problem_variable} "there is no npm (package npm)" PARENT_SCOPE)
      return()
    endif()
    execute_process(
      COMMAND ${NPM_PROGRAM} pack --silent --fetch-retries=0 --fetch-timeout=30000 ${package}@${version}
      WORKING_DIRECTORY ${folder}
      OUTPUT_QUIET ERROR_QUIET TIMEOUT 90)
    if(NOT EXISTS ${tarball})
      set(${problem_variable} "npm cannot fetch ${package}@${version}" PARENT_SCOPE)
      return()
    endif()
  endif()
  file(SHA512 ${tarball} found)
  if(NOT found STREQUAL sha512)
    file(REMOVE ${tarball})
    set(${problem_variable} "what came is not ${package}@${version}: its SHA-512 differs" PARENT_SCOPE)
    return()
  endif()
  file(ARCHIVE_EXTRACT INPUT ${tarball} DESTINATION ${folder}/${name})
endfunction()

# Sets `program_variable` to esbuild, and `problem_variable` to the reason if it cannot be had.
function(color3d_fetch_esbuild folder program_variable problem_variable)
  set(version 0.25.12)
  set(problem "")
  if(CMAKE_SYSTEM_NAME STREQUAL "Linux" AND CMAKE_HOST_SYSTEM_PROCESSOR MATCHES "^(x86_64|amd64)$")
    set(package linux-x64)
    set(sha512
        baa64c4cbaffcd1fde7788c81a7c122e468798f8ce8c9be79ba4d5562b406b4f122d2f59d1533cc08471ee059b241e7f279e18b883089c3aae5b262f40b66483)
  elseif(CMAKE_SYSTEM_NAME STREQUAL "Linux" AND CMAKE_HOST_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
    set(package linux-arm64)
    set(sha512
        f1bc17edaf05821220aeea5cc5be1a5266032e9f295f4eab1a1e47a834fb6c1fbc45d7a596cea61efac51c75b624038f6546e78d4a4a4cb83a102cb3bdab3601)
  else()
    set(problem "esbuild is not pinned for ${CMAKE_SYSTEM_NAME} on ${CMAKE_HOST_SYSTEM_PROCESSOR}")
  endif()
  if(NOT problem)
    color3d_fetch_tool(${folder} @esbuild/${package} ${version} ${sha512} problem)
    set(${program_variable} ${folder}/esbuild-${package}/package/bin/esbuild PARENT_SCOPE)
  endif()
  set(${problem_variable} "${problem}" PARENT_SCOPE)
endfunction()

# Sets `script_variable` to the type checker's program for Node.
function(color3d_fetch_typescript folder script_variable problem_variable)
  color3d_fetch_tool(
    ${folder} typescript 5.9.3
    8e5d6f6733c38a72ebf5e52ddc9feded5e8580d130f508ef04f772b33f4a7d00c3e357d0ac2d98e2f290762694a454f86d795bd511e12e9a7cc2d9ba3394e04b
    problem)
  set(${script_variable} ${folder}/typescript/package/lib/tsc.js PARENT_SCOPE)
  set(${problem_variable} "${problem}" PARENT_SCOPE)
endfunction()
