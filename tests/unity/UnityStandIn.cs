// What the package in unity/ uses of Unity, as far as tests need it: it compiles against this. The mesh refuses what
// Unity's does, and keeps the arrays it is given, with how much of them counts.
using System;
using System.Collections.Generic;
using System.Linq;

namespace UnityEngine
{
    public struct Vector2
    {
        public float x, y;
    }

    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 Min(Vector3 a, Vector3 b) { return new Vector3(Math.Min(a.x, b.x), Math.Min(a.y, b.y), Math.Min(a.z, b.z)); }
        public static Vector3 Max(Vector3 a, Vector3 b) { return new Vector3(Math.Max(a.x, b.x), Math.Max(a.y, b.y), Math.Max(a.z, b.z)); }
    }

    public struct Color32
    {
        public byte r, g, b, a;
    }

    public struct Bounds
    {
        public Vector3 min, max;
        public void SetMinMax(Vector3 least, Vector3 most) { min = least; max = most; }
    }

    public enum MeshTopology { Triangles }

    public class Object
    {
        public string name;
        public bool destroyed;
        public static void Destroy(Object which) { which.destroyed = true; }
    }

    public class Mesh : Object
    {
        public Rendering.IndexFormat indexFormat;
        public Bounds bounds;
        public Vector3[] vertices, normals;
        public Color32[] colours;
        public Vector2[] texcoords;
        public int[] indices;
        public int vertexCount, indexCount, recalculated;

        public void MarkDynamic() { }

        public void Clear()
        {
            vertices = normals = null;
            colours = null;
            texcoords = null;
            indices = null;
            vertexCount = indexCount = 0;
        }

        void Check(Array array, int start, int length)
        {
            if (start != 0 || length > array.Length) throw new ArgumentException("more than the array has");
            if (length != vertexCount) throw new ArgumentException("as many as there are vertices");
        }

        public void SetVertices(Vector3[] to, int start, int length)
        {
            if (indices != null && length != vertexCount) throw new ArgumentException("triangles would name other vertices");
            vertexCount = length;
            Check(to, start, length);
            vertices = to;
        }

        public void SetColors(Color32[] to, int start, int length) { Check(to, start, length); colours = to; }
        public void SetNormals(Vector3[] to, int start, int length) { Check(to, start, length); normals = to; }
        public void SetUVs(int channel, Vector2[] to, int start, int length) { Check(to, start, length); texcoords = to; }

        public void SetIndices(int[] to, int start, int length, MeshTopology topology, int submesh, bool calculateBounds)
        {
            for (int i = start; i < start + length; ++i)
                if (to[i] < 0 || to[i] >= vertexCount) throw new ArgumentException("an index out of range");
            if (indexFormat != Rendering.IndexFormat.UInt32) throw new ArgumentException("65,535 vertices at most");
            indices = to;
            indexCount = length;
        }

        public void RecalculateNormals() { ++recalculated; }
    }

    public class Component : Object
    {
        public GameObject gameObject;
        public T GetComponent<T>() where T : class { return gameObject.GetComponent<T>(); }
    }

    public class MonoBehaviour : Component { }
    public class MeshFilter : Component { public Mesh sharedMesh; }
    public class MeshRenderer : Component { public Material sharedMaterial; }
    public class Transform : Component { public Vector3 position; }
    public class Shader : Object { public static Shader Find(string name) { return new Shader { name = name }; } }
    public class Material : Object { public Shader shader; public Material(Shader shader) { this.shader = shader; } }

    public class GameObject : Object
    {
        public static readonly List<GameObject> all = new List<GameObject>();
        readonly List<Component> components = new List<Component>();
        public readonly Transform transform = new Transform();

        public GameObject(string name, params Type[] types)
        {
            this.name = name;
            foreach (var type in types) Add((Component)Activator.CreateInstance(type));
            all.Add(this);
        }

        void Add(Component component)
        {
            component.gameObject = this;
            components.Add(component);
        }

        public T AddComponent<T>() where T : Component, new()
        {
            var component = new T();
            Add(component);
            return component;
        }

        public T GetComponent<T>() where T : class
        {
            foreach (var component in components)
                if (component is T) return component as T;
            return null;
        }
    }

    public class ScriptableObject : Object
    {
        public static T CreateInstance<T>() where T : ScriptableObject, new() { return new T(); }
    }

    public class RequireComponent : Attribute { public RequireComponent(Type a, Type b) { } }
    public class AddComponentMenu : Attribute { public AddComponentMenu(string path) { } }
    public class TooltipAttribute : Attribute { public TooltipAttribute(string text) { } }
    public class HideInInspector : Attribute { }
    public class PreferBinarySerialization : Attribute { }
    public static class Application { public static string streamingAssetsPath; }
    public static class Time { public static float deltaTime; }
    public static class Debug
    {
        public static readonly List<string> warnings = new List<string>();
        public static void LogWarning(string text) { warnings.Add(text); }
    }

    namespace Rendering
    {
        public enum IndexFormat { UInt16, UInt32 }
    }
}

namespace UnityEditor.AssetImporters
{
    public class ScriptedImporterAttribute : Attribute { public ScriptedImporterAttribute(int version, string ending) { } }

    public abstract class ScriptedImporter
    {
        public abstract void OnImportAsset(AssetImportContext context);
    }

    public class AssetImportContext
    {
        public string assetPath;
        public readonly Dictionary<string, UnityEngine.Object> assets = new Dictionary<string, UnityEngine.Object>();
        public readonly List<string> errors = new List<string>();
        public UnityEngine.Object main;
        public void AddObjectToAsset(string name, UnityEngine.Object which) { assets.Add(name, which); }
        public void SetMainObject(UnityEngine.Object which) { main = which; }
        public void LogImportError(string text) { errors.Add(text); }
    }
}
