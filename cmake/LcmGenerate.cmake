# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
#
# LCM types of the project: lcm-gen turns lcmtypes/*.lcm into C++ headers in the build folder.
include_guard()

find_program(LCM_GEN lcm-gen REQUIRED)

# topoloc_lcm_types(<target> <package> files...): interface library <target>; its users include
# "<package>/<type>.hpp". One file holds the types that its name ends in: topoloc_image_t.lcm may
# define several, all of which lcm-gen writes in one go.
function(topoloc_lcm_types target package)
  set(out ${CMAKE_BINARY_DIR}/lcmtypes)
  set(headers)
  foreach(file ${ARGN})
    file(STRINGS ${file} structs REGEX "^struct [a-z_0-9]+")
    list(TRANSFORM structs REPLACE "^struct ([a-z_0-9]+).*" "${out}/${package}/\\1.hpp")
    list(APPEND headers ${structs})
  endforeach()
  add_custom_command(OUTPUT ${headers}
                     COMMAND ${LCM_GEN} --cpp --cpp-std c++11 --cpp-hpath ${out} ${ARGN}
                     DEPENDS ${ARGN}
                     COMMENT "Generating LCM types of package ${package}"
                     VERBATIM)
  add_custom_target(${target}_headers DEPENDS ${headers})
  add_library(${target} INTERFACE)
  add_dependencies(${target} ${target}_headers)
  target_include_directories(${target} SYSTEM INTERFACE ${out})
  target_link_libraries(${target} INTERFACE lcm::lcm)
endfunction()
