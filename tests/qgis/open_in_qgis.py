"""Open a project with real QGIS and say what it sees, as JSON; runs under the Python that has PyQGIS.

Usage: open_in_qgis.py PROJECT describe | render THEME PNG | move_vertex N DX DZ | review ID STATUS REMARK [LAYER [KIND]]
       | draw KIND | draw_findings | write_action | results LAYER | add VIEW
       | draw_layer LAYER XMIN,YMIN,XMAX,YMAX PNG | numbers LAYER
       | atlas PDF [LAYOUT] | preview | where CHAINAGE ARC | labels LAYER | space [PNG]
       | serve
"""

from __future__ import annotations

import json
import os
import sys
import types
import zipfile
from pathlib import Path
from typing import Any

import qgis.utils
from qgis._3d import Qgs3D, Qgs3DMapSettings, QgsCameraPose, QgsLayoutItem3DMap
from qgis.core import (
    QgsApplication,
    QgsDataSourceUri,
    QgsExpression,
    QgsExpressionContext,
    QgsExpressionContextScope,
    QgsExpressionContextUtils,
    QgsFeature,
    QgsFeatureRequest,
    QgsGeometry,
    QgsLayoutExporter,
    QgsLayoutItemPage,
    QgsLayoutPoint,
    QgsLayoutSize,
    QgsMapLayer,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsPalettedRasterRenderer,
    QgsPalLayerSettings,
    QgsPointXY,
    QgsPrintLayout,
    QgsProject,
    QgsReadWriteContext,
    QgsRectangle,
    QgsRenderContext,
    QgsRunProcess,
    QgsVector3D,
    QgsVectorLayer,
    QgsVectorLayerUtils,
    QgsWkbTypes,
)
from qgis.gui import QgsMapCanvas
from qgis.PyQt.QtCore import QDate, QSize
from qgis.PyQt.QtGui import QColor, QOpenGLContext, QSurfaceFormat
from qgis.PyQt.QtXml import QDomDocument

PREFIX = "tunneldb_layer_"
WIDTH, HEIGHT = 1600, 640
SPACE_SIZE, SPACE_DPI = (297.0, 210.0), 60.0
"""Picture of the 3D view, mm and dots per inch."""


def describe(project: QgsProject, canvas: QgsMapCanvas) -> dict[str, Any]:
    """Everything that the tests compare with the database."""
    layers = {}
    for layer in project.mapLayers().values():
        seen: dict[str, Any] = {"valid": layer.isValid(), "crs": layer.crs().authid(), "source": layer.source()}
        if isinstance(layer, QgsVectorLayer):
            editable = [
                layer.fields().at(i).name() for i in range(layer.fields().count()) if not layer.editFormConfig().readOnly(i)
            ]
            features = list(layer.getFeatures())
            seen |= {
                "wkb": QgsWkbTypes.displayString(layer.wkbType()),
                "features": len(features),
                "counted": layer.featureCount(),
                "z": [max((v.z() for v in f.geometry().vertices()), default=None) for f in features],
                "widget": {f.name(): layer.editorWidgetSetup(layer.fields().indexOf(f.name())).type() for f in layer.fields()},
                "aliases": [f.name() for f in layer.fields() if layer.attributeAlias(layer.fields().indexOf(f.name()))],
                "read_only": layer.readOnly(),
                "editable": editable,
                "renderer": layer.renderer().type() if layer.isSpatial() else None,
                "labels": layer.labelsEnabled(),
                "error": layer.error().summary() if not layer.error().isEmpty() else "",
                "extent": layer.extent().toString(),
            }
            if layer.renderer3D() is not None:
                document = QDomDocument()
                layer.exportNamedStyle(document, QgsReadWriteContext(), QgsMapLayer.Symbology3D)
                data = document.documentElement().firstChildElement("renderer-3d").elementsByTagName("data").at(0).toElement()
                seen |= {"clamping": data.attribute("alt-clamping"), "binding": data.attribute("alt-binding")}
        elif isinstance(layer.renderer(), QgsPalettedRasterRenderer):
            seen["legend"] = [[entry.value, entry.label, entry.color.name()] for entry in layer.renderer().classes()]
        layers[layer.id().removeprefix(PREFIX)] = seen
    collection = project.mapThemeCollection()
    return {
        "crs": project.crs().authid(),
        "layers": layers,
        "themes": {
            name: [layer.removeprefix(PREFIX) for layer in collection.mapThemeVisibleLayerIds(name)]
            for name in collection.mapThemes()
        },
        "bookmarks": [bookmark.name() for bookmark in project.bookmarkManager().bookmarks()],
        "canvas_theme": canvas.theme(),
        "canvas_extent": canvas.extent().toString(3),
        "extent": project.viewSettings().defaultViewExtent().toString(3),
        "full_extent": project.viewSettings().fullExtent().toString(3),
    }


def render(project: QgsProject, theme: str, path: str) -> dict[str, Any]:
    """Draw a theme at its bookmark and report the errors."""
    bookmark = next(b for b in project.bookmarkManager().bookmarks() if b.name() == theme)
    settings = QgsMapSettings()
    settings.setLayers(project.mapThemeCollection().mapThemeVisibleLayers(theme))
    settings.setDestinationCrs(bookmark.extent().crs())
    return _paint(settings, QgsRectangle(bookmark.extent()), path)


def draw_layer(project: QgsProject, layer_id: str, box: str, path: str) -> dict[str, Any]:
    """Draw a rectangle of one layer of the unrolled plane and report the errors."""
    settings = QgsMapSettings()
    settings.setLayers([project.mapLayer(PREFIX + layer_id)])
    return _paint(settings, QgsRectangle(*map(float, box.split(","))), path)


def atlas(project: QgsProject, path: str, name: str = "Inspection sheets") -> dict[str, Any]:
    """Print the pages of an atlas to one PDF."""
    layout = project.layoutManager().layoutByName(name)
    sheets = layout.atlas()
    settings = QgsLayoutExporter.PdfExportSettings()
    wanted = int(layout.customProperty("pdfTextFormat"))  # as the dialogue takes it from there
    settings.textRenderFormat = QgsRenderContext.TextRenderFormat(wanted)
    result, error = QgsLayoutExporter.exportToPdf(sheets, path, settings)
    return {"saved": result == QgsLayoutExporter.Success, "error": error, "sheets": sheets.count()}


def preview(project: QgsProject) -> dict[str, Any]:
    """Scale of the strip of each sheet as the layout designer previews them: it has scales to choose from."""
    layout = project.layoutManager().layoutByName("Inspection sheets")
    own = layout.renderContext().predefinedScales()
    layout.renderContext().setPredefinedScales([500.0, 1000.0, 2500.0])
    sheets, strip = layout.atlas(), layout.itemById("strip")
    sheets.beginRender()
    scales = []
    while sheets.next():
        layout.reportContext().setLayer(sheets.coverageLayer())
        scales.append(round(strip.scale()))
    sheets.endRender()
    layout.renderContext().setPredefinedScales(own)
    return {"scales": scales}


def space(project: QgsProject, path: str = "") -> dict[str, Any]:
    """What QGIS reads of the 3D view, drawn into a picture if a path is given."""
    file = Path(project.fileName())
    with zipfile.ZipFile(file) as archive:
        text = archive.read(archive.namelist()[0]).decode()
    document = QDomDocument()
    assert document.setContent(text)[0]
    view = document.documentElement().firstChildElement("mapViewDocks3D").firstChildElement("view")
    settings = Qgs3DMapSettings()
    settings.readXml(view.firstChildElement("qgis3d"), QgsReadWriteContext())
    settings.resolveReferences(project)
    at = view.firstChildElement("camera")
    camera = {name: float(at.attribute(name)) for name in ("x", "y", "elev", "xMap", "yMap", "zMap", "dist", "pitch", "yaw")}
    seen = {
        "name": view.attribute("name"),
        "open": view.attribute("isOpen"),
        "crs": settings.crs().authid(),
        "layers": [layer.id().removeprefix(PREFIX) for layer in settings.layers()],
        "origin": [settings.origin().x(), settings.origin().y(), settings.origin().z()],
        "terrain": settings.terrainRenderingEnabled(),
        "offset": settings.terrainElevationOffset(),
        "lights": len(settings.directionalLights()) + len(settings.pointLights()),
        "camera": camera,
    }
    return seen | _draw_space(project, settings, camera, path) if path else seen


def _draw_space(project: QgsProject, settings: Qgs3DMapSettings, camera: dict[str, float], path: str) -> dict[str, Any]:
    wanted = QSurfaceFormat()
    wanted.setVersion(3, 3)
    wanted.setProfile(QSurfaceFormat.CoreProfile)
    context = QOpenGLContext()
    context.setFormat(wanted)
    if not context.create() or context.format().version() < (3, 3):
        return {"drawn": "needs OpenGL 3.3"}
    layout = QgsPrintLayout(project)
    page = QgsLayoutItemPage(layout)
    page.setPageSize(QgsLayoutSize(*SPACE_SIZE))
    layout.pageCollection().addPage(page)
    item = QgsLayoutItem3DMap(layout)
    item.setBackgroundColor(QColor("white"))
    item.attemptMove(QgsLayoutPoint(0, 0))
    item.attemptResize(QgsLayoutSize(*SPACE_SIZE))
    pose = QgsCameraPose()
    pose.setCenterPoint(QgsVector3D(camera["x"], camera["elev"], camera["y"]))
    pose.setDistanceFromCenterPoint(camera["dist"])
    pose.setPitchAngle(camera["pitch"])
    pose.setHeadingAngle(camera["yaw"])
    item.setMapSettings(settings)
    item.setCameraPose(pose)
    layout.addLayoutItem(item)
    export = QgsLayoutExporter.ImageExportSettings()
    export.dpi = SPACE_DPI
    return {"drawn": QgsLayoutExporter(layout).exportToImage(path, export) == QgsLayoutExporter.Success}


def where(project: QgsProject, chainage: str, arc: str) -> dict[str, Any]:
    """Click on a place of the unrolled plane with the action of the sheets, and read its map tip there."""
    told: list[str] = []
    bar = types.SimpleNamespace(pushInfo=lambda *words: told.extend(words))
    qgis.utils.iface = types.SimpleNamespace(messageBar=lambda: bar)
    layer = project.mapLayer(PREFIX + "sheet")
    context = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
    click = QgsExpressionContextScope()
    click.setVariable("click_x", float(chainage))
    click.setVariable("click_y", float(arc))
    click.setVariable("layer_cursor_point", QgsGeometry.fromPointXY(QgsPointXY(float(chainage), float(arc))))
    context.appendScope(click)
    context.setFeature(next(f for f in layer.getFeatures() if f["chainage_from"] <= float(chainage) < f["chainage_to"]))
    (action,) = layer.actions().actions("Canvas")
    exec(QgsExpression.replaceExpressionText(action.command(), context), {})
    return {"told": told, "tip": QgsExpression.replaceExpressionText(layer.mapTipTemplate(), context)}


def labels(project: QgsProject, layer_id: str) -> dict[str, Any]:
    """What is written beside the features of a layer, where its rule shows a label."""
    layer = project.mapLayer(PREFIX + layer_id)
    settings = layer.labeling().settings()
    expression = QgsExpression(settings.fieldName)
    shown = settings.dataDefinedProperties().property(QgsPalLayerSettings.Show)
    context = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
    texts = []
    for feature in layer.getFeatures():
        context.setFeature(feature)
        if not shown.isActive() or shown.valueAsBool(context, True)[0]:
            texts.append(expression.evaluate(context))
    return {"texts": texts, "error": expression.evalErrorString()}


def numbers(project: QgsProject, layer_id: str) -> dict[str, Any]:
    """Which findings a layer shows."""
    return {"numbers": sorted(feature["id"] for feature in project.mapLayer(PREFIX + layer_id).getFeatures())}


def _paint(settings: QgsMapSettings, extent: QgsRectangle, path: str) -> dict[str, Any]:
    settings.setExtent(extent)
    settings.setOutputSize(QSize(WIDTH, HEIGHT))
    settings.setBackgroundColor(QColor("white"))
    settings.setFlag(QgsMapSettings.Antialiasing)
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    saved = job.renderedImage().save(path)
    return {"saved": saved, "errors": [f"{e.layerID}: {e.message}" for e in job.errors()]}


def move_vertex(project: QgsProject, n: str, dx: str, dz: str) -> dict[str, Any]:
    """Move one axis vertex as the vertex tool does."""
    layer = project.mapLayer(PREFIX + "axis_vertex")
    feature = next(f for f in layer.getFeatures() if f["n"] == int(n))
    point = feature.geometry().constGet().clone()
    point.setX(point.x() + float(dx))
    point.setZ(point.z() + float(dz))
    assert layer.startEditing(), "cannot be edited"
    assert layer.changeGeometry(feature.id(), QgsGeometry(point))
    return _commit(layer)


def review(
    project: QgsProject, number: str, status: str, remark: str, layer_id: str = "leak_unrolled", kind: str = ""
) -> dict[str, Any]:
    """Set a leak's review and remark, and its kind if one is given, as the form does."""
    layer = project.mapLayer(PREFIX + layer_id)
    feature = next(f for f in layer.getFeatures() if f["id"] == int(number))
    assert layer.startEditing(), "cannot be edited"
    values = [("review", status), ("remark", remark), *([("kind", kind)] if kind else [])]
    for name, value in values:
        assert layer.changeAttributeValue(feature.id(), layer.fields().indexOf(name), value)
    return _commit(layer)


def recompute(project: QgsProject) -> dict[str, Any]:
    """The command of the action "Recompute", in words as QGIS starts it, and the layers that offer it."""
    offered = {}
    for layer_id in ("axis_vertex", "segment"):
        layer = project.mapLayer(PREFIX + layer_id)
        context = QgsExpressionContext(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
        (action,) = [action for action in layer.actions().actions("Layer") if action.shortTitle() == "Recompute"]
        offered[layer_id] = QgsRunProcess.splitCommand(QgsExpression.replaceExpressionText(action.command(), context))
    return offered


def draw(project: QgsProject, kind: str) -> dict[str, Any]:
    """Draw a region in the unrolled plane, with the values that the form would fill in; kind "default" is left to it."""
    layer = project.mapLayer(PREFIX + "region")
    square = [QgsPointXY(12440, 1), QgsPointXY(12444, 1), QgsPointXY(12444, 3), QgsPointXY(12440, 3)]
    assert layer.startEditing(), "cannot be edited"
    attributes = {layer.fields().indexOf("kind"): kind} if kind != "default" else {}
    feature = QgsVectorLayerUtils.createFeature(layer, QgsGeometry.fromPolygonXY([square]), attributes)
    assert layer.addFeature(QgsFeature(feature))
    return _commit(layer)


def draw_findings(project: QgsProject) -> dict[str, Any]:
    """Draw one in each layer that takes findings, with the values that the form begins with; what each is offered."""
    shapes = {
        "finding_area_unrolled": "POLYGON((12350 1, 12351 1, 12351 2, 12350 1))",
        "finding_line_unrolled": "LINESTRING(12355 1, 12357 2)",
        "finding_point_unrolled": "POINT(12360 1)",
        "leak_unrolled": "POLYGON((12365 1, 12366 1, 12366 2, 12365 1))",
    }
    done: dict[str, Any] = {}
    for layer_id, shape in shapes.items():
        layer = project.mapLayer(PREFIX + layer_id)
        assert layer.startEditing(), layer_id
        feature = QgsVectorLayerUtils.createFeature(layer, QgsGeometry.fromWkt(shape), {})
        assert layer.addFeature(feature), layer_id
        done[layer_id] = _commit(layer)
        if layer_id.startswith("finding"):
            offered = layer.editorWidgetSetup(layer.fields().indexOf("kind")).config()["FilterExpression"]
            request = QgsFeatureRequest(QgsExpression(offered.split(" OR ")[0]))
            catalogue = project.mapLayer(PREFIX + "finding_kind")
            done[layer_id]["kinds"] = sorted(row["code"] for row in catalogue.getFeatures(request))
            relations = project.relationManager().referencedRelations(layer)
            done[layer_id]["photos"] = [relation.referencingLayer().name() for relation in relations]
    for layer_id, seen in done.items():
        features = project.mapLayer(PREFIX + layer_id).getFeatures()
        seen["shapes"] = sorted({QgsWkbTypes.displayString(feature.geometry().wkbType()) for feature in features})
    return done


def write_action(project: QgsProject) -> dict[str, Any]:
    """Draw an action on the lining with the values that the form begins with, and order it, as the form does."""
    layer = project.mapLayer(PREFIX + "action_unrolled")
    column = layer.fields().indexOf
    assert layer.startEditing(), "cannot be edited"
    feature = QgsVectorLayerUtils.createFeature(
        layer, QgsGeometry.fromPointXY(QgsPointXY(12360.1234, 1.5)), {column("measure"): "inject the joint"}
    )
    assert layer.addFeature(feature)
    added = _commit(layer)
    (stored,) = [one for one in layer.getFeatures() if one["measure"] == "inject the joint"]
    assert layer.startEditing()
    for name, value in (("state", "ordered"), ("due", QDate(2021, 3, 31)), ("cost", 1200.5), ("currency", "EUR")):
        assert layer.changeAttributeValue(stored.id(), column(name), value), name
    changed = _commit(layer)
    choices = {
        name: [value for one in layer.editorWidgetSetup(column(name)).config()["map"] for value in one.values()]
        for name in ("urgency", "state")
    }
    return {"added": added, "changed": changed, "choices": choices, "due": layer.editorWidgetSetup(column("due")).type()}


def results(project: QgsProject, layer_id: str) -> dict[str, Any]:
    """Each element with the labels of the legend under which it is drawn, and its label."""
    layer = project.mapLayer(PREFIX + layer_id)
    context = QgsRenderContext()
    context.expressionContext().appendScopes(QgsExpressionContextUtils.globalProjectLayerScopes(layer))
    renderer = layer.renderer().clone()
    renderer.startRender(context, layer.fields())
    labels = {item.ruleKey(): item.label() for item in renderer.legendSymbolItems()}
    text = QgsExpression(layer.labeling().settings().fieldName)
    found = {}
    for feature in layer.getFeatures():
        context.expressionContext().setFeature(feature)
        keys = renderer.legendKeysForFeature(feature, context)
        found[feature["name"]] = [
            sorted(labels[key] for key in keys if labels.get(key)),
            text.evaluate(context.expressionContext()),
        ]
    renderer.stopRender(context)
    return {"elements": found, "legend": list(labels.values()), "title": layer.name()}


def add(project: QgsProject, view: str) -> dict[str, Any]:
    """Add a view by hand, as from the browser, and report whether its style was found in the database."""
    uri = QgsDataSourceUri(project.mapLayer(PREFIX + "leak_map").source())
    uri.setDataSource("tunnel_api", view, "geom", "", "id")
    uri.setSrid("")
    uri.setWkbType(QgsWkbTypes.Unknown)
    layer = QgsVectorLayer(uri.uri(False), view, "postgres")
    message, loaded = layer.loadDefaultStyle()
    return {
        "valid": layer.isValid(),
        "loaded": loaded,
        "message": message,
        "renderer": layer.renderer().type(),
        "alias": layer.attributeAlias(1),
        "wkb": QgsWkbTypes.displayString(layer.wkbType()),
        "crs": layer.crs().authid(),
    }


def _commit(layer: QgsVectorLayer) -> dict[str, Any]:
    saved = layer.commitChanges()
    return {"saved": saved, "errors": layer.commitErrors()}


def run(project: QgsProject, canvas: QgsMapCanvas, action: str, *arguments: str) -> dict[str, Any]:
    """Run one action."""
    return describe(project, canvas) if action == "describe" else globals()[action](project, *arguments)


def serve(project: QgsProject, canvas: QgsMapCanvas) -> None:
    """Run actions, a list of words a line, until the input ends; print a line for each, and what QGIS prints on the errors."""
    with os.fdopen(os.dup(1), "w") as answers:
        os.dup2(2, 1)
        for line in sys.stdin:
            print(json.dumps(run(project, canvas, *json.loads(line))), file=answers, flush=True)


def main() -> None:
    """Run one action, or those that are asked for, and print what comes of it."""
    application = QgsApplication([], True)
    application.initQgis()
    Qgs3D.initialize()
    project = QgsProject.instance()
    canvas = QgsMapCanvas()
    canvas.setObjectName("Unrolled")
    project.readProject.connect(canvas.readProject)
    assert project.read(sys.argv[1]), project.error()
    if sys.argv[2] == "serve":
        serve(project, canvas)
    else:
        print(json.dumps(run(project, canvas, *sys.argv[2:])))
    project.clear()
    sys.stdout.flush()
    # Leaving the interpreter normally makes QGIS crash now and then in its own destructors.
    os._exit(0)


if __name__ == "__main__":
    main()
