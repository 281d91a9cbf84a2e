// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc-evaluate/python_tool.hpp"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

namespace topoloc::apps {
namespace {

namespace fs = std::filesystem;

int wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) != child) {
    if (errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "waitpid");
    }
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

/// Interpreter, tool and arguments; sets TOPOLOC_BIN.
std::vector<std::string> tool_command(const std::string& name,
                                      const std::vector<std::string>& arguments) {
  const fs::path root = TOPOLOC_SOURCE_DIR;
  const std::string python = (root / ".venv/bin/python").string();
  const std::string tool = (root / "tools" / name).string();
  for (const std::string& file : {python, tool}) {
    if (!fs::exists(file)) {
      throw std::runtime_error(file + " is missing (see README, set-up)");
    }
  }
  std::error_code none;
  const fs::path here = fs::read_symlink("/proc/self/exe", none).parent_path();
  ::setenv("TOPOLOC_BIN", here.c_str(), 0);
  std::vector<std::string> command{python, tool};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

/// Returns only where it fails.
void execute(std::vector<std::string>& command) {
  std::vector<char*> argv;
  for (std::string& word : command) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  execv(argv.front(), argv.data());
}

}  // namespace

void become_python_tool(const std::string& name, const std::vector<std::string>& arguments) {
  std::vector<std::string> command = tool_command(name, arguments);
  execute(command);
  throw std::system_error(errno, std::generic_category(), command.front());
}

int run_python_tool(const std::string& name, const std::vector<std::string>& arguments) {
  std::vector<std::string> command = tool_command(name, arguments);
  const pid_t child = fork();
  if (child == 0) {
    execute(command);
    _exit(127);
  }
  if (child < 0) {
    throw std::system_error(errno, std::generic_category(), "fork");
  }
  return wait_for(child);
}

}  // namespace topoloc::apps
