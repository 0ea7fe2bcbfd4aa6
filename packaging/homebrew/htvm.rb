# Homebrew's formula for the libraries: brew install --HEAD packaging/homebrew/htvm.rb
# With a release, `url` and `sha256` name its source archive.
class Htvm < Formula
  desc "Compression of captured 3D people: decoder, encoder and C interface"
  license "Apache-2.0"
  head "file://#{File.expand_path("../..", __dir__)}", using: :git, branch: "main"

  depends_on "cmake" => :build
  depends_on "eigen" => :build
  depends_on "nanoflann" => :build
  depends_on "tl-expected"

  def install
    system "cmake", "-S", ".", "-B", "build", "-DHTVM_BUILD_TOOLS=OFF", "-DHTVM_BUILD_TESTS=OFF",
           "-DHTVM_BUILD_BENCHMARKS=OFF", *std_cmake_args
    system "cmake", "--build", "build"
    system "cmake", "--install", "build"
    pkgshare.install "examples/encode.c", "examples/decode.c"
  end

  test do
    flags = shell_output("pkg-config --cflags --libs htvm-c").split
    system ENV.cc, pkgshare/"encode.c", "-o", "encode", *flags
    system ENV.cc, pkgshare/"decode.c", "-o", "decode", *flags
    system "./encode", "sheet.htvm"
    assert_match "frame 0: I", shell_output("./decode sheet.htvm")
  end
end
