// What examples/unity/HtvmPlayer.cs uses of Unity, as far as a test needs it: it compiles against this, and plays a stream.
using System;
using System.IO;
using System.Linq;
using System.Reflection;
using Htvm;

namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
    }

    public struct Color32
    {
        public byte r, g, b, a;
        public Color32(byte r, byte g, byte b, byte a) { this.r = r; this.g = g; this.b = b; this.a = a; }
    }

    public enum MeshTopology { Triangles }

    public class Mesh
    {
        public Rendering.IndexFormat indexFormat;
        public Vector3[] vertices;
        public Color32[] colors;
        public int[] indices;
        public void MarkDynamic() { }
        public void Clear() { vertices = null; colors = null; indices = null; }
        public void SetVertices(Vector3[] to) { vertices = to; }
        public void SetColors(Color32[] to) { colors = to; }
        public void SetIndices(int[] to, MeshTopology topology, int submesh) { indices = to; }
        public void RecalculateNormals() { }
    }

    public class MeshFilter { public Mesh mesh; }
    public class MeshRenderer { }
    public class RequireComponent : Attribute { public RequireComponent(Type a, Type b) { } }
    public static class Application { public static string streamingAssetsPath; }
    public static class Time { public static float deltaTime; }
    public static class Debug { public static void LogWarning(string text) { throw new Exception(text); } }

    public class MonoBehaviour
    {
        readonly MeshFilter filter = new MeshFilter();
        public T GetComponent<T>() where T : class { return filter as T; }
        public Mesh Shown { get { return filter.mesh; } }
    }

    namespace Rendering
    {
        public enum IndexFormat { UInt32 }
    }
}

static class UnityStandIn
{
    static void Call(object component, string message)
    {
        typeof(HtvmPlayer).GetMethod(message, BindingFlags.Instance | BindingFlags.NonPublic).Invoke(component, null);
    }

    // Plays a stream of 30 frames a second, at 60 pictures a second, twice, and compares each picture's mesh.
    static void Main(string[] arguments)
    {
        var stream = arguments[0];
        UnityEngine.Application.streamingAssetsPath = Path.GetDirectoryName(stream);
        UnityEngine.Time.deltaTime = 1 / 60f;
        int frames = 0;
        using (var reader = new FrameReader(File.OpenRead(stream)))
            while (reader.Next()) ++frames;
        var player = new HtvmPlayer { file = Path.GetFileName(stream) };
        Call(player, "Start");
        for (int round = 0; round < 2; ++round)
            using (var expected = new FrameReader(File.OpenRead(stream)))
                for (int picture = 0; picture < 2 * frames - 1; ++picture)
                {
                    Call(player, "Update");
                    if (picture % 2 == 0 && !expected.Next()) throw new Exception("the stream is shorter");
                    Compare(player.Shown, expected, picture);
                }
        Call(player, "OnDestroy");
        Console.WriteLine("1 passed, 0 failed");
    }

    static void Compare(UnityEngine.Mesh mesh, FrameReader expected, int picture)
    {
        bool same = mesh.vertices.Length == expected.VertexCount && mesh.indices.Length == expected.IndexCount;
        for (int v = 0; same && v < mesh.vertices.Length; ++v)
            same = mesh.vertices[v].x == -0.001f * expected.Positions[3 * v] &&
                   mesh.vertices[v].z == 0.001f * expected.Positions[3 * v + 2] && mesh.colors[v].g == expected.Colours[3 * v + 1];
        for (int i = 0; same && i < mesh.indices.Length; i += 3)
            same = mesh.indices[i + 1] == expected.Indices[i + 2] && mesh.indices[i + 2] == expected.Indices[i + 1];
        if (!same) throw new Exception("picture " + picture + " shows another frame");
    }
}
