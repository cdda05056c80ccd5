#include "tests/apps/program_run.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace clothfit::test {
namespace {

constexpr const char* kOut = "stdout.txt";
constexpr const char* kError = "stderr.txt";

std::string read_all(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Becomes the program in the child; never returns.
[[noreturn]] void become_program(std::vector<char*>& arguments, const char* folder) {
  if (chdir(folder) != 0) _exit(126);
  const int out = open(kOut, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int error = open(kError, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  dup2(out, STDOUT_FILENO);
  dup2(error, STDERR_FILENO);
  execv(arguments.front(), arguments.data());
  _exit(127);
}

}  // namespace

ProgramRun run_program(const std::vector<std::string>& arguments,
                       const std::filesystem::path& folder,
                       const std::function<void(int process)>& while_running) {
  std::vector<std::string> words = {CLOTHFIT_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);

  const pid_t process = fork();
  if (process < 0) throw std::runtime_error("fork failed");
  if (process == 0) become_program(pointers, folder.c_str());
  if (while_running) while_running(process);
  int status = 0;
  waitpid(process, &status, 0);

  ProgramRun run;
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  run.out = read_all(folder / kOut);
  run.error = read_all(folder / kError);
  return run;
}

std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name != kOut && name != kError) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace clothfit::test
