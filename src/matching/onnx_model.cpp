// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/onnx_model.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <onnxruntime_session_options_config_keys.h>
#include <xxhash.h>

namespace topoloc::matching {
namespace {

Ort::Env& environment() {
  static Ort::Env env(ORT_LOGGING_LEVEL_ERROR, "topoloc");  // one per process, by ONNX Runtime
  return env;
}

std::vector<char> read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw std::runtime_error(
        path.string() +
        ": cannot read this model file; `make setup` makes those for 640x384 and "
        "1248x384 pixels and 512 and 1024 features, for others set "
        "TOPOLOC_MODELS or matching.model_dir to the folder that has it");
  }
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string to_string(const std::vector<std::int64_t>& shape) {
  std::string text;
  for (const std::int64_t side : shape) {
    text += (text.empty() ? "" : "x") + std::to_string(side);
  }
  return text.empty() ? "scalar" : text;
}

Ort::SessionOptions session_options(int threads, const std::string& execution_provider) {
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(threads);
  options.SetInterOpNumThreads(1);
  options.SetExecutionMode(ORT_SEQUENTIAL);
  options.SetGraphOptimizationLevel(ORT_ENABLE_ALL);
  options.SetDeterministicCompute(true);
  // Waiting threads sleep: the estimator needs the cores more than the network needs microseconds.
  options.AddConfigEntry(kOrtSessionOptionsConfigAllowIntraOpSpinning, "0");
  // Masked attention is full of denormals, each of which costs a microcode trap.
  options.AddConfigEntry(kOrtSessionOptionsConfigSetDenormalAsZero, "1");
  if (execution_provider == "cuda") {
    const std::vector<std::string> available = Ort::GetAvailableProviders();
    if (std::find(available.begin(), available.end(), "CUDAExecutionProvider") == available.end()) {
      throw std::runtime_error(
          "execution provider 'cuda': this ONNX Runtime was built without it; install the GPU "
          "build or set matching.execution_provider to 'cpu'");
    }
    options.AppendExecutionProvider_CUDA(OrtCUDAProviderOptions{});
  } else if (execution_provider != "cpu") {
    throw std::runtime_error("execution provider '" + execution_provider +
                             "' is not one of: cpu, cuda");
  }
  return options;
}

}  // namespace

OnnxModel::OnnxModel(const std::filesystem::path& path, int threads,
                     const std::string& execution_provider)
    : path_(path) {
  const std::vector<char> file = read_file(path);
  fingerprint_ = XXH3_64bits(file.data(), file.size());
  try {
    session_ = Ort::Session(environment(), file.data(), file.size(),
                            session_options(threads, execution_provider));
    inputs_ = allocate(true);
    outputs_ = allocate(false);
    binding_ = Ort::IoBinding(session_);
    for (const Tensor& tensor : inputs_) {
      binding_.BindInput(tensor.name.c_str(), tensor.value);
    }
    for (const Tensor& tensor : outputs_) {
      binding_.BindOutput(tensor.name.c_str(), tensor.value);
    }
  } catch (const Ort::Exception& error) {
    throw std::runtime_error(path.string() + ": " + error.what());
  }
}

std::vector<OnnxModel::Tensor> OnnxModel::allocate(bool inputs) const {
  Ort::AllocatorWithDefaultOptions allocator;
  const std::size_t count = inputs ? session_.GetInputCount() : session_.GetOutputCount();
  std::vector<Tensor> tensors;
  tensors.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Tensor tensor;
    tensor.name = (inputs ? session_.GetInputNameAllocated(i, allocator)
                          : session_.GetOutputNameAllocated(i, allocator))
                      .get();
    // The type information owns the shape information: keep it alive.
    const Ort::TypeInfo type =
        inputs ? session_.GetInputTypeInfo(i) : session_.GetOutputTypeInfo(i);
    const auto info = type.GetTensorTypeAndShapeInfo();
    tensor.type = info.GetElementType();
    tensor.shape = info.GetShape();
    if (std::any_of(tensor.shape.begin(), tensor.shape.end(), [](auto side) { return side < 1; })) {
      throw std::runtime_error(path_.string() + ": tensor '" + tensor.name + "' has shape " +
                               to_string(tensor.shape) + ", expected a model with fixed shapes");
    }
    tensor.value =
        Ort::Value::CreateTensor(allocator, tensor.shape.data(), tensor.shape.size(), tensor.type);
    tensors.push_back(std::move(tensor));
  }
  return tensors;
}

OnnxModel::Tensor& OnnxModel::find(std::vector<Tensor>& tensors, const char* kind,
                                   const std::string& name, ONNXTensorElementDataType type,
                                   const std::vector<std::int64_t>& shape) const {
  for (Tensor& tensor : tensors) {
    if (tensor.name == name) {
      if (tensor.type != type || tensor.shape != shape) {
        throw std::runtime_error(path_.string() + ": " + kind + " '" + name + "' has shape " +
                                 to_string(tensor.shape) + " and type " +
                                 std::to_string(tensor.type) + ", expected " + to_string(shape) +
                                 " and type " + std::to_string(type));
      }
      return tensor;
    }
  }
  throw std::runtime_error(path_.string() + ": the model has no " + kind + " '" + name + "'");
}

std::span<float> OnnxModel::input(const std::string& name, const std::vector<std::int64_t>& shape) {
  Tensor& tensor = find(inputs_, "input", name, ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT, shape);
  return {tensor.value.GetTensorMutableData<float>(),
          tensor.value.GetTensorTypeAndShapeInfo().GetElementCount()};
}

template <typename T>
std::span<const T> OnnxModel::output(const std::string& name,
                                     const std::vector<std::int64_t>& shape) {
  Tensor& tensor = find(outputs_, "output", name, Ort::TypeToTensorType<T>::type, shape);
  return {tensor.value.GetTensorData<T>(),
          tensor.value.GetTensorTypeAndShapeInfo().GetElementCount()};
}
template std::span<const float> OnnxModel::output<float>(const std::string&,
                                                         const std::vector<std::int64_t>&);
template std::span<const std::int32_t> OnnxModel::output<std::int32_t>(
    const std::string&, const std::vector<std::int64_t>&);

void OnnxModel::run() {
  try {
    session_.Run(Ort::RunOptions{nullptr}, binding_);
  } catch (const Ort::Exception& error) {
    throw std::runtime_error(path_.string() + ": " + error.what());
  }
}

}  // namespace topoloc::matching
