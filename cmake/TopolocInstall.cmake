# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
#
# What goes on another machine (docs/deployment.md):
#   component vehicle: vehicle process, camera bridge, models, samples of what to set up around them
#   component tools: everything else
include_guard()
include(GNUInstallDirs)

set(TOPOLOC_INSTALL_MODELS ${TOPOLOC_THIRD_PARTY}/models CACHE PATH
    "Folder of the model files to install")
set(data ${CMAKE_INSTALL_DATADIR}/topoloc)
set(libraries ${CMAKE_INSTALL_LIBDIR}/topoloc)

function(topoloc_install component)
  foreach(program ${ARGN})
    set_target_properties(${program} PROPERTIES
                          INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}/topoloc")
    install(TARGETS ${program} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${component})
  endforeach()
endfunction()
topoloc_install(vehicle topoloc-localise topoloc-camera topoloc-can-decode)
topoloc_install(tools topoloc-map topoloc-replay topoloc-evaluate topoloc-calibrate topoloc-simulate)

# Libraries that third_party/fetch got and Debian 12 does not have, under the names that the loader
# looks for; those of the system are left to its packages.
function(topoloc_install_library component library)
  cmake_path(IS_PREFIX TOPOLOC_THIRD_PARTY "${library}" NORMALIZE fetched)
  if(fetched)
    file(GLOB names "${library}.?" "${library}.??")  # libNAME.so.1, a link
    foreach(name ${names})
      get_filename_component(soname ${name} NAME)
      file(REAL_PATH ${name} file)
      install(FILES ${file} RENAME ${soname} DESTINATION ${libraries} COMPONENT ${component})
    endforeach()
  endif()
endfunction()
topoloc_install_library(vehicle ${ONNXRUNTIME_LIBRARY})
topoloc_install_library(tools ${LASZIP_LIBRARY})
topoloc_install_library(tools ${LASZIP_API_LIBRARY})

install(DIRECTORY ${TOPOLOC_INSTALL_MODELS}/ DESTINATION ${data}/models COMPONENT vehicle OPTIONAL
        FILES_MATCHING PATTERN "*.onnx" PATTERN "models.json")
install(DIRECTORY ${CMAKE_SOURCE_DIR}/config DESTINATION ${data} COMPONENT vehicle)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/lcmtypes DESTINATION ${data} COMPONENT vehicle
        FILES_MATCHING PATTERN "*.lcm")
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT vehicle
        FILES_MATCHING PATTERN "*.md")
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT vehicle)
install(FILES ${CMAKE_SOURCE_DIR}/third_party/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}
        RENAME third-party.md COMPONENT vehicle)

# Units find the programs by the prefix; systemd looks into /usr/lib and /usr/local/lib by itself.
foreach(unit topoloc-localise topoloc-camera)
  configure_file(${CMAKE_SOURCE_DIR}/deploy/${unit}.service.in
                 ${CMAKE_BINARY_DIR}/deploy/${unit}.service @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/deploy/${unit}.service DESTINATION lib/systemd/system
          COMPONENT vehicle)
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/deploy/topoloc-lcm-loopback.service
        DESTINATION lib/systemd/system COMPONENT vehicle)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/deploy DESTINATION ${data} COMPONENT vehicle
        PATTERN "*.service*" EXCLUDE)
