# The viewer of the page (MIT), fetched from npm when the build is configured: exactly this version,
# checked by its digest. Leaves viewer_program.gz and viewer_license.txt in FOLDER; both empty, with one line that says
# why, where it cannot be had.
set(COLOR3D_VIEWER_PACKAGE "" CACHE FILEPATH
    "The viewer's npm package as a file, for building without a network")

function(color3d_fetch_viewer folder name_variable)
  set(package supersplat-viewer)
  set(version 1.36.2)
  set(sha512
      2fbc340656a00289d11d0839aa1683c8107cceb46d894f5082094d53791482ca87a6890202db9ff63e0fd24c6c51a427eb5159d6a2469112ac3826eb2c20d1d3)
  set(${name_variable} "SuperSplat Viewer ${version}" PARENT_SCOPE)
  file(MAKE_DIRECTORY ${folder})
  set(tarball ${folder}/playcanvas-${package}-${version}.tgz)
  set(left_out "")
  if(COLOR3D_VIEWER_PACKAGE)
    file(COPY_FILE ${COLOR3D_VIEWER_PACKAGE} ${tarball} RESULT left_out)
    if(left_out STREQUAL "0")
      set(left_out "")
    else()
      set(left_out "${COLOR3D_VIEWER_PACKAGE}: ${left_out}")
    endif()
  elseif(NOT EXISTS ${tarball})
    find_program(NPM_PROGRAM npm)
    if(NPM_PROGRAM)
      execute_process(
        COMMAND ${NPM_PROGRAM} pack --silent --fetch-retries=0 --fetch-timeout=30000
                @playcanvas/${package}@${version}
        WORKING_DIRECTORY ${folder}
        OUTPUT_QUIET ERROR_QUIET TIMEOUT 60)
      if(NOT EXISTS ${tarball})
        set(left_out "npm cannot fetch @playcanvas/${package}@${version}")
      endif()
    else()
      set(left_out "there is no npm (package npm)")
    endif()
  endif()
  if(NOT left_out)
    file(SHA512 ${tarball} found)
    if(NOT found STREQUAL sha512)
      file(REMOVE ${tarball})
      set(left_out "what came is not @playcanvas/${package}@${version}: its SHA-512 differs")
    endif()
  endif()
  if(left_out)
    message(STATUS "Left out: the page to look at scenes in a browser (view.html); ${left_out}")
    foreach(name IN ITEMS viewer_program.gz viewer_license.txt)
      file(CONFIGURE OUTPUT ${folder}/${name} CONTENT "")  # anew only when it changes
    endforeach()
    return()
  endif()
  if(EXISTS ${folder}/viewer_program.gz AND ${folder}/viewer_program.gz IS_NEWER_THAN ${tarball})
    file(SIZE ${folder}/viewer_program.gz size)
    if(size GREATER 0)
      return()
    endif()
  endif()
  file(ARCHIVE_EXTRACT INPUT ${tarball} DESTINATION ${folder}
       PATTERNS package/public/index.js package/LICENSE)
  file(COPY_FILE ${folder}/package/LICENSE ${folder}/viewer_license.txt)
  file(ARCHIVE_CREATE OUTPUT ${folder}/viewer_program.gz PATHS ${folder}/package/public/index.js
       FORMAT raw COMPRESSION GZip COMPRESSION_LEVEL 9)
endfunction()
