"""COLLADA: units, transforms, materials, primitives; compared with pycollada on the common features."""

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from roboyard.errors import MeshError
from roboyard.shapes.load import clear_cache, load_mesh

TRIANGLE = "0 0 0 1 0 0 0 1 0"


@pytest.fixture(autouse=True)
def empty_cache():
    clear_cache()


def source(name, numbers, stride=3):
    count = len(numbers.split())
    params = "".join(f'<param name="{letter}" type="float"/>' for letter in "XYZ"[:stride])
    return (
        f'<source id="{name}"><float_array id="{name}-array" count="{count}">{numbers}</float_array>'
        f'<technique_common><accessor source="#{name}-array" count="{count // stride}" stride="{stride}">'
        f"{params}</accessor></technique_common></source>"
    )


def document(
    primitives,
    positions=TRIANGLE,
    sources="",
    nodes='<node><instance_geometry url="#g"/></node>',
    unit="1",
    libraries="",
):
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f'<asset><unit meter="{unit}"/><up_axis>Y_UP</up_axis></asset>{libraries}'
        f'<library_geometries><geometry id="g"><mesh>{source("p", positions)}{sources}'
        f'<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{primitives}</mesh></geometry>'
        f'</library_geometries><library_visual_scenes><visual_scene id="s">{nodes}</visual_scene>'
        '</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )


VERTEX = '<input semantic="VERTEX" source="#v" offset="0"/>'
TRIANGLES = f'<triangles count="1" material="m">{VERTEX}<p>0 1 2</p></triangles>'


def load(tmp_path, text):
    file = tmp_path / "meshes" / "a.dae"
    file.parent.mkdir(exist_ok=True)
    file.write_text(text)
    return load_mesh(file)


def corners(mesh):
    return mesh.vertices[mesh.faces]


def test_unit_is_applied_and_up_axis_is_not(tmp_path):
    mesh = load(tmp_path, document(TRIANGLES, unit="0.001"))
    np.testing.assert_allclose(corners(mesh), [[[0, 0, 0], [0.001, 0, 0], [0, 0.001, 0]]], atol=1e-15)


def test_node_transforms_apply_in_document_order(tmp_path):
    nodes = (
        "<node><translate>1 2 3</translate><rotate>0 0 2 90</rotate><node><scale>2 2 4</scale>"
        "<matrix>1 0 0 0 0 1 0 0 0 0 1 5 0 0 0 1</matrix>"
        '<instance_geometry url="#g"/></node></node>'
    )
    mesh = load(tmp_path, document(TRIANGLES, nodes=nodes))
    local = np.array([[0, 0, 5], [1, 0, 5], [0, 1, 5]])
    turned = Rotation.from_euler("z", 90, degrees=True).apply(local * [2, 2, 4])
    expected = turned + np.array([1, 2, 3])
    np.testing.assert_allclose(corners(mesh)[0], expected, atol=1e-12)


def test_only_the_visual_scene_is_read(tmp_path):
    library = (
        '<library_nodes><node id="part"><translate>0 0 1</translate><instance_geometry url="#g"/></node>'
        '<node id="unused"><translate>9 9 9</translate><instance_geometry url="#g"/></node></library_nodes>'
    )
    nodes = '<node><instance_node url="#part"/></node><node><instance_geometry url="#g"/></node>'
    mesh = load(tmp_path, document(TRIANGLES, nodes=nodes, libraries=library))
    assert len(mesh.faces) == 2
    assert mesh.bounds[1].tolist() == [1, 1, 1]


def test_elements_of_other_tags_may_have_the_same_id(tmp_path):
    """As 3ds Max's exporter writes them."""
    materials = (
        '<library_effects><effect id="g"><profile_COMMON><technique><phong><diffuse><color>1 0 0 1</color>'
        "</diffuse></phong></technique></profile_COMMON></effect></library_effects>"
        '<library_materials><material id="g"><instance_effect url="#g"/></material></library_materials>'
    )
    nodes = (
        '<node id="s"><node id="g"><translate>1 2 3</translate><instance_geometry url="#g"/></node></node>'
    )
    primitives = TRIANGLES.replace('material="m"', 'material="g"')
    mesh = load(tmp_path, document(primitives, nodes=nodes, libraries=materials))
    np.testing.assert_allclose(corners(mesh), [[[1, 2, 3], [2, 2, 3], [1, 3, 3]]])
    assert mesh.colors.tolist() == [[255, 0, 0, 255]]


def test_recursive_nodes_raise(tmp_path):
    nodes = '<node id="n"><instance_node url="#n"/><instance_node url="#n"/></node>'
    with pytest.raises(Exception, match="nodes nested deeper than"):
        load(tmp_path, document(TRIANGLES, nodes=nodes))


def test_mirroring_nodes_flip_the_faces(tmp_path):
    nodes = '<node><scale>-1 1 1</scale><instance_geometry url="#g"/></node>'
    mesh = load(tmp_path, document(TRIANGLES, nodes=nodes))
    a, b, c = corners(mesh)[0]
    assert np.cross(b - a, c - a)[2] > 0


@pytest.mark.parametrize(
    ("primitive", "count"),
    [
        (f'<polylist count="2">{VERTEX}<vcount>4 3</vcount><p>0 1 2 3 0 1 2</p></polylist>', 3),
        (f'<polygons count="2">{VERTEX}<p>0 1 2 3</p><p>0 1 2</p></polygons>', 3),
        (f'<tristrips count="1">{VERTEX}<p>0 1 3 2</p></tristrips>', 2),
        (f'<trifans count="1">{VERTEX}<p>0 1 2 3</p></trifans>', 2),
        (f'{TRIANGLES}<lines count="1">{VERTEX}<p>0 1</p></lines>', 1),
    ],
    ids=["polylist", "polygons", "tristrips", "trifans", "lines"],
)
def test_primitives(tmp_path, primitive, count):
    square = "0 0 0 1 0 0 1 1 0 0 1 0"
    mesh = load(tmp_path, document(primitive, positions=square))
    assert len(mesh.faces) == count
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    normals = np.cross(b - a, c - a)
    np.testing.assert_allclose(normals, np.tile([0, 0, 1], (count, 1)), atol=1e-12)


MATERIAL = (
    '<library_materials><material id="paint"><instance_effect url="#e"/></material></library_materials>'
    '<library_effects><effect id="e"><profile_COMMON>{}<technique sid="t"><phong>{}</phong></technique>'
    "</profile_COMMON></effect></library_effects>"
)
BOUND = (
    '<node><instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="m" '
    'target="#paint"/></technique_common></bind_material></instance_geometry></node>'
)


def test_diffuse_colour(tmp_path):
    library = MATERIAL.format("", "<diffuse><color>1 0.5 0 0</color></diffuse>")
    mesh = load(tmp_path, document(TRIANGLES, nodes=BOUND, libraries=library))
    assert mesh.colors.tolist() == [[255, 128, 0, 255]]


def test_broken_references_drop_no_triangles(tmp_path):
    (tmp_path / "meshes").mkdir()
    Image.new("RGB", (2, 2), (7, 8, 9)).save(tmp_path / "meshes" / "skin one.png")
    surface = (
        '<newparam sid="surface"><surface type="2D"><init_from>image</init_from></surface></newparam>'
        '<newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>'
    )
    images = (
        '<library_images><image id="image"><init_from>skin%20one.png</init_from></image></library_images>'
    )
    library = images + MATERIAL.format(
        surface, '<diffuse><texture texture="sampler" texcoord="UV"/></diffuse>'
    )
    primitive = (
        '<triangles count="1" material="m"><input semantic="VERTEX" source="#v" offset="0"/>'
        '<input semantic="TEXCOORD" source="#t" offset="1" set="0"/><p>0 2 1 1 2 0</p></triangles>'
    )
    sources = source("t", "0 0 1 0 0 1", stride=2)
    mesh = load(tmp_path, document(primitive, sources=sources, nodes=BOUND, libraries=library))
    assert mesh.texture[0, 0].tolist() == [7, 8, 9, 255]
    shown = mesh.uv[mesh.faces[0]].tolist()
    assert shown == [[0, 1], [1, 0], [0, 0]]
    broken = library.replace("<source>surface</source>", "<source>gone</source>")
    mesh = load(tmp_path, document(primitive, sources=sources, nodes=BOUND, libraries=broken))
    assert len(mesh.faces) == 1
    assert mesh.texture is None


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_same_triangles_and_normals_as_pycollada(tmp_path):
    collada = pytest.importorskip("collada")
    rng = np.random.default_rng(0)
    positions = rng.normal(size=(30, 3)).round(3)
    normals = rng.normal(size=(20, 3)).round(3)
    sizes = rng.integers(3, 7, size=12)
    total = int(sizes.sum())
    index = np.stack([rng.integers(0, 30, total), rng.integers(0, 20, total)], axis=1)

    def text(array):
        return " ".join(map(str, np.ravel(array)))

    primitive = (
        '<polylist count="12"><input semantic="VERTEX" source="#v" offset="0"/>'
        '<input semantic="NORMAL" source="#n" offset="1"/>'
        f"<vcount>{text(sizes)}</vcount><p>{text(index)}</p></polylist>"
    )
    nodes = (
        "<node><translate>1 2 3</translate><rotate>0.6 0.8 0 40</rotate><scale>1 2 3</scale>"
        '<instance_geometry url="#g"/></node>'
    )
    file = tmp_path / "a.dae"
    sources = source("n", text(normals))
    file.write_text(document(primitive, positions=text(positions), sources=sources, nodes=nodes))
    bound = next(iter(next(iter(collada.Collada(str(file)).scene.objects("geometry"))).primitives()))
    judge = bound.triangleset()
    mesh = load_mesh(file)
    np.testing.assert_allclose(corners(mesh), judge.vertex[judge.vertex_index], atol=1e-5)
    upright = load(tmp_path, document(primitive, positions=text(positions), sources=sources))
    expected = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(upright.normals[upright.faces], expected[judge.normal_index], atol=1e-12)


@pytest.mark.parametrize(
    "numbers", ["0 0 0 1_000.0 0 0 0 1e+0 0", "\n0\t0 0 1000 0 0 0 +1. -0\n", "0 0 0 ١٠٠٠ 0 0 0 1 0"]
)
def test_numbers_are_those_that_python_reads(tmp_path, numbers):
    mesh = load(tmp_path, document(TRIANGLES, positions=numbers))
    np.testing.assert_array_equal(corners(mesh), [[[0, 0, 0], [1000, 0, 0], [0, 1, 0]]])


@pytest.mark.parametrize("numbers", ["0 0 0 1 0 0 0 1 x", "0 0 0 1 0 0 0 1,0 0", "0 0 0 1 0 0 0 0x1 0"])
def test_words_among_numbers_are_refused(tmp_path, numbers):
    with pytest.raises(MeshError):
        load(tmp_path, document(TRIANGLES, positions=numbers))


def test_shortest_spelling_keeps_every_bit(tmp_path):
    positions = np.random.default_rng(0).normal(size=(3, 3)) * 10.0 ** np.arange(-9, 18, 3).reshape(3, 3)
    mesh = load(tmp_path, document(TRIANGLES, positions=" ".join(map(str, positions.ravel().tolist()))))
    np.testing.assert_array_equal(corners(mesh)[0], positions)


@pytest.mark.parametrize("rest", ["        </polylist>\n      </mesh>\n", "\0\0\0", document(TRIANGLES)])
def test_the_rest_of_a_longer_file_behind_the_end_is_left_out(tmp_path, rest):
    whole = document(TRIANGLES)
    assert np.array_equal(corners(load(tmp_path, whole + rest)), corners(load(tmp_path, whole)))


def test_blank_lines_before_the_declaration_are_skipped(tmp_path):
    whole = document(TRIANGLES)
    assert np.array_equal(corners(load(tmp_path, "  \n\n" + whole)), corners(load(tmp_path, whole)))


def test_a_file_that_is_broken_before_its_end_is_refused(tmp_path):
    with pytest.raises(MeshError, match="not a readable DAE file"):
        load(tmp_path, document(TRIANGLES).replace("</node>", "") + "</mesh>")
