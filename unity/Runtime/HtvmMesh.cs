// Frames as a Unity mesh: metres, left-handed, y up. Its arrays are used again for the next frame and grow with the
// largest, so that frames make no garbage.
using System;
using UnityEngine;
using UnityEngine.Rendering;

namespace Htvm
{
    public sealed class HtvmMesh
    {
        public readonly Mesh Mesh;
        Vector3[] vertices = new Vector3[0], normals = new Vector3[0];
        Color32[] colours = new Color32[0];
        Vector2[] texcoords = new Vector2[0];
        int[] indices = new int[0];

        public HtvmMesh()
        {
            Mesh = new Mesh { name = "htvm", indexFormat = IndexFormat.UInt32 };
            Mesh.MarkDynamic();
        }

        // fresh: whether the mesh shows something else than the frame taken before this one, as at the beginning.
        public void Show(Frame frame, Up up, bool fresh)
        {
            int count = frame.VertexCount;
            bool triangles = fresh || frame.TopologyChanged;
            if (triangles) Mesh.Clear(); // they are those of other vertices
            Grow(ref vertices, count);
            Turn(frame.Positions, vertices, count, up, 0.001f);
            Mesh.SetVertices(vertices, 0, count);
            if (frame.Has(Attributes.Colours)) ShowColours(frame.Colours, count);
            if (frame.Has(Attributes.Texcoords) && (triangles || frame.ReferenceChanged || frame.Has(Attributes.MovingTexcoords))) ShowTexcoords(frame.Texcoords, count);
            if (triangles) ShowTriangles(frame);
            Mesh.bounds = BoundsOf(frame);
            if (frame.Has(Attributes.Normals))
            {
                Grow(ref normals, count);
                Turn(frame.Normals, normals, count, up, 1);
                Mesh.SetNormals(normals, 0, count);
            }
            else
            {
                Mesh.RecalculateNormals();
            }
        }

        // The stream's axes to Unity's: the one that is up to y by a turn, and x mirrored.
        static void Turn(float[] from, Vector3[] to, int count, Up up, float scale)
        {
            for (int v = 0; v < count; ++v)
            {
                float x = from[3 * v], y = from[3 * v + 1], z = from[3 * v + 2], across = x, high = y, deep = z;
                switch (up)
                {
                    case Up.MinusY: across = -x; high = -y; break;
                    case Up.Z: high = z; deep = -y; break;
                    case Up.MinusZ: high = -z; deep = y; break;
                    case Up.X: across = -y; high = x; break;
                    case Up.MinusX: across = y; high = -x; break;
                }
                to[v].x = -scale * across;
                to[v].y = scale * high;
                to[v].z = scale * deep;
            }
        }

        void ShowColours(byte[] from, int count)
        {
            Grow(ref colours, count);
            for (int v = 0; v < count; ++v)
            {
                colours[v].r = from[3 * v];
                colours[v].g = from[3 * v + 1];
                colours[v].b = from[3 * v + 2];
                colours[v].a = 255;
            }
            Mesh.SetColors(colours, 0, count);
        }

        // Unity counts from a picture's lower edge.
        void ShowTexcoords(float[] from, int count)
        {
            Grow(ref texcoords, count);
            for (int v = 0; v < count; ++v)
            {
                texcoords[v].x = from[2 * v];
                texcoords[v].y = 1 - from[2 * v + 1];
            }
            Mesh.SetUVs(0, texcoords, 0, count);
        }

        // A mirrored triangle turns the other way.
        void ShowTriangles(Frame frame)
        {
            int count = frame.IndexCount;
            Grow(ref indices, count);
            for (int i = 0; i < count; i += 3)
            {
                indices[i] = frame.Indices[i];
                indices[i + 1] = frame.Indices[i + 2];
                indices[i + 2] = frame.Indices[i + 1];
            }
            Mesh.SetIndices(indices, 0, count, MeshTopology.Triangles, 0, false);
        }

        // Where a vertex that is not there stands is a guess.
        Bounds BoundsOf(Frame frame)
        {
            var least = new Vector3(float.MaxValue, float.MaxValue, float.MaxValue);
            var most = new Vector3(float.MinValue, float.MinValue, float.MinValue);
            for (int v = 0; v < frame.VertexCount; ++v)
            {
                if (frame.Info.Absent > 0 && frame.Presence[v] == 0) continue;
                least = Vector3.Min(least, vertices[v]);
                most = Vector3.Max(most, vertices[v]);
            }
            var bounds = new Bounds();
            if (least.x <= most.x) bounds.SetMinMax(least, most);
            return bounds;
        }

        static void Grow<T>(ref T[] array, int count)
        {
            if (array.Length < count) array = new T[Math.Max(count, 2 * array.Length)];
        }
    }
}
