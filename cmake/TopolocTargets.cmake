# Functions that keep every module, program and test to one line: a module is a folder.
include_guard()

add_library(topoloc_options INTERFACE)
target_compile_features(topoloc_options INTERFACE cxx_std_20)
target_compile_options(topoloc_options INTERFACE -Wall -Wextra -Wconversion -Wshadow -Werror)
# Same input, same output, bit for bit, on every x86-64 or arm64 machine: no fused multiply-add.
target_compile_options(topoloc_options INTERFACE -ffp-contract=off)
if(TOPOLOC_SANITIZE)
  target_compile_options(topoloc_options INTERFACE -fsanitize=${TOPOLOC_SANITIZE}
                                                   -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(topoloc_options INTERFACE -fsanitize=${TOPOLOC_SANITIZE})
  # GCC 12 suspects std::regex once it is instrumented.
  target_compile_options(topoloc_options INTERFACE -Wno-maybe-uninitialized)
  # Instrumented code compiles slowly: each module as one source file.
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)
  target_compile_options(topoloc_options INTERFACE -Wno-subobject-linkage)
endif()
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -g1 -DNDEBUG")
# Eigen's, the library's and our own checks on; -O1, since Eigen without inlining is far too slow.
set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g1 -D_GLIBCXX_ASSERTIONS")
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

# topoloc_module(<name> [PUBLIC libs...] [PRIVATE libs...]): library topoloc::<name> from
# src/<name>/*.cpp, public headers in include/topoloc/<name>/.
function(topoloc_module name)
  cmake_parse_arguments(ARG "" "" "PUBLIC;PRIVATE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/${name}/*.cpp)
  set(target topoloc_${name})
  if(sources)
    add_library(${target} STATIC ${sources})
    target_include_directories(${target} PUBLIC ${CMAKE_SOURCE_DIR}/include
                                         PRIVATE ${CMAKE_SOURCE_DIR}/src)
    target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE topoloc_options ${ARG_PRIVATE})
    target_compile_features(${target} PUBLIC cxx_std_20)
  else()
    add_library(${target} INTERFACE)
    target_include_directories(${target} INTERFACE ${CMAKE_SOURCE_DIR}/include)
    target_link_libraries(${target} INTERFACE ${ARG_PUBLIC})
  endif()
  add_library(topoloc::${name} ALIAS ${target})
endfunction()

# topoloc_app(<program> libs...): apps/<program>/*.cpp becomes build/<preset>/bin/<program>.
function(topoloc_app program)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/apps/${program}/*.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(${program} ${sources})
  target_include_directories(${program} PRIVATE ${CMAKE_SOURCE_DIR}/apps)
  target_link_libraries(${program} PRIVATE topoloc_options ${ARGN} CLI11::CLI11 fmt::fmt)
  target_compile_definitions(${program} PRIVATE TOPOLOC_VERSION="${PROJECT_VERSION}"
                                                TOPOLOC_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
endfunction()

# All unit tests: what the sanitizer builds need.
add_custom_target(unit_tests)

# topoloc_test(<kind> <module> libs...): tests/<kind>/<module>/*.cpp becomes test <kind>_<module>.
function(topoloc_test kind module)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/tests/${kind}/${module}/*.cpp)
  if(NOT sources)
    message(FATAL_ERROR "tests/${kind}/${module} holds no test")
  endif()
  set(target ${kind}_${module})
  add_executable(${target} ${sources})
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/tests ${CMAKE_SOURCE_DIR}/src)
  target_link_libraries(${target} PRIVATE topoloc_options ${ARGN} GTest::gtest_main GTest::gmock)
  target_compile_definitions(${target} PRIVATE TOPOLOC_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
                                               TOPOLOC_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
  if(kind STREQUAL "unit")
    add_dependencies(unit_tests ${target})
  endif()
  if(kind STREQUAL "hil")  # on virtual CAN interfaces; skipped where there can be none
    add_test(NAME ${target}
             COMMAND ${CMAKE_SOURCE_DIR}/tools/with-vcan --interfaces vcan0,vcan1 --timeout 600
                     $<TARGET_FILE:${target}>)
    set_tests_properties(${target} PROPERTIES SKIP_RETURN_CODE 125 RUN_SERIAL TRUE)
  else()
    add_test(NAME ${target} COMMAND ${target})
  endif()
  set_tests_properties(${target} PROPERTIES LABELS ${kind} TIMEOUT 900)
  if(TOPOLOC_SANITIZE MATCHES thread)
    set_tests_properties(${target} PROPERTIES
                         ENVIRONMENT TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/tests/tsan.supp)
  endif()
endfunction()
